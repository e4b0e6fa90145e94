//! GDAL opens the maps of an estimate, and finds every metre's leaf area index where it lies.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::with_programs;
use crate::counts::Counts;
use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

/// The scenario whose run has scans and positions, its rig, and where it is kept.
const SCENARIO: &str = "tools/scenarios/tractor.toml";
const RIG: &str = "tools/scenarios/row.toml";
const RUN: &str = "01-tractor/seed-7-run-1/run.mcap";

/// Writes maps of one run in three formats and asks GDAL for them.
pub fn run(workspace: &Workspace) -> Outcome {
    with_programs(workspace, &["gdalinfo", "gdallocationinfo", "ogrinfo"], &["gdal-bin"], |workspace| {
        let mut counts = Counts::default();
        let result = open(workspace, &mut counts);
        Outcome::from_tests(counts, result)
    })
}

fn open(workspace: &Workspace, counts: &mut Counts) -> Result<(), String> {
    let binary = workspace.built_binary()?;
    let folder = workspace.scratch("maps")?;
    let kept = folder.join("kept");
    let _ = std::fs::remove_dir_all(&kept);
    let mut check = Command::new(&binary);
    check.current_dir(&workspace.root).args(["check", SCENARIO, "--keep"]).arg(&kept);
    shell::capture(&mut check)?;
    let map = |ending: &str| folder.join(format!("row.{ending}"));
    let mut estimate = Command::new(&binary);
    estimate.current_dir(&workspace.root).arg("estimate").arg(kept.join(RUN)).args(["--rig", RIG]);
    for ending in ["geojson", "gpkg", "tif"] {
        let _ = std::fs::remove_file(map(ending));
        estimate.arg("--map").arg(map(ending));
    }
    shell::capture(&mut estimate)?;
    let metres = metres(&map("geojson"))?;
    counts.passed += 1;

    let geopackage = shell::capture(Command::new("ogrinfo").arg("-so").arg(map("gpkg")).arg("leaf_area"))?;
    let count = format!("Feature Count: {}", metres.len());
    says(
        "ogrinfo",
        &geopackage,
        &["using driver `GPKG' successful", "Polygon", "WGS 84", "lai: Real", &count],
    )?;
    counts.passed += 1;

    let picture = shell::capture(Command::new("gdalinfo").arg(map("tif")))?;
    says("gdalinfo", &picture, &["WGS 84 / UTM zone 31N", "Type=Float32", "NoData Value=nan"])?;
    counts.passed += 1;

    for metre in &metres {
        let [lon, lat] = metre.middle.map(|degrees| format!("{degrees:.9}"));
        let mut at = Command::new("gdallocationinfo");
        at.args(["-valonly", "-wgs84"]).arg(map("tif")).args([lon, lat]);
        let found = shell::capture(&mut at)?;
        let lai: f64 = found.trim().parse().map_err(|_| format!("gdallocationinfo says `{found}`"))?;
        if (lai - metre.lai).abs() > 1e-4 {
            return Err(format!("GDAL finds an index of {lai} where the estimate has {}", metre.lai));
        }
    }
    counts.passed += 1;
    Ok(())
}

/// A metre whose index is known.
struct Metre {
    middle: [f64; 2],
    lai: f64,
}

/// The metres of a map in GeoJSON, all of them known.
fn metres(path: &Path) -> Result<Vec<Metre>, String> {
    let text = std::fs::read_to_string(path).map_err(|cause| format!("{}: {cause}", path.display()))?;
    let map: Value = serde_json::from_str(&text).map_err(|cause| format!("{}: {cause}", path.display()))?;
    let features = map["features"].as_array().ok_or("no features")?;
    let metre = |feature: &Value| {
        let ring = feature["geometry"]["coordinates"][0].as_array()?;
        let middle =
            |axis: usize| Some(ring.iter().take(4).map(|at| at[axis].as_f64()).sum::<Option<f64>>()? / 4.0);
        Some(Metre { middle: [middle(0)?, middle(1)?], lai: feature["properties"]["lai"].as_f64()? })
    };
    let metres: Option<Vec<Metre>> = features.iter().map(metre).collect();
    metres.filter(|metres| metres.len() >= 2).ok_or(format!("two known metres were expected: {text}"))
}

fn says(program: &str, text: &str, parts: &[&str]) -> Result<(), String> {
    match parts.iter().find(|part| !text.contains(**part)) {
        None => Ok(()),
        Some(part) => Err(format!("{program} does not say `{part}`: {text}")),
    }
}
