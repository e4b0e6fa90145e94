//! Maps of leaf area: metres lie where the scene has them, by a receiver in the recording or by a stated row.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use rowscan_vehicle::earth::metres_per_degree;
use serde_json::Value;

use crate::common::binary::{assert_says, refused, run, text};

const LATITUDE: f64 = 41.6;
const LONGITUDE: f64 = 0.84;
const AZIMUTH: f64 = 30.0;

/// A row that runs to the north-east by east, by a receiver of 2 cm whose antenna is beside the tractor's middle.
const SCENE: &str = "version = 2
[orchard]
trees = 5
[orchard.tree]
iterations = 7
[gnss]
latitude_deg = 41.6
longitude_deg = 0.84
azimuth_deg = 30.0
noise_m = 0.02
rate_hz = 10
antenna_forward_m = 0.6
antenna_right_m = -0.3
[rig]
tree_spacing_m = 1.5
row_spacing_m = 4.0
[[rig.scanner]]
model = \"lms111\"
offset_y_m = 0.7
";

const SCENARIO: &str = r#"version = 1
scene = "row.toml"
seed = 7
clock = { mode = "lockstep", ack = { sut = "idle" }, deadline_wall_s = 60 }
end = { row_m = 12 }
device = [{ id = "left", model = "lms111" }]
nmea = [{ id = "gnss", port = "tcp:127.0.0.1:0" }]
run = [{ id = "sut", command = ["{rowscan}", "estimate", "tcp://{left.tcp}", "--wait", "--rig", "{scenario}/row.toml"], ready = { line = "connected" } }]
expect = [{ what = "scans_lost", equals = 0 }]
"#;

/// The scene and a recording of it, made once.
fn recording() -> &'static (tempfile::TempDir, PathBuf, PathBuf) {
    static MADE: OnceLock<(tempfile::TempDir, PathBuf, PathBuf)> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let (scene, scenario) = (folder.path().join("row.toml"), folder.path().join("drive.toml"));
        fs::write(&scene, SCENE).expect("written");
        fs::write(&scenario, SCENARIO).expect("written");
        let keep = folder.path().join("kept");
        let ended = run(&["check", text(&scenario), "--keep", text(&keep)]);
        assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
        let file = keep.join("01-drive/seed-7-run-1/run.mcap");
        assert!(file.exists(), "{}", file.display());
        (folder, scene, file)
    })
}

/// Y of each metre of a map in GeoJSON, how far its middle is from the row's axis there, metres, and its properties.
fn metres(map: &Path) -> Vec<(f64, f64, Value)> {
    let map: Value = serde_json::from_str(&fs::read_to_string(map).expect("written")).expect("JSON");
    let (north_m, east_m) = metres_per_degree(LATITUDE);
    let (sin, cos) = AZIMUTH.to_radians().sin_cos();
    let features = map["features"].as_array().expect("features");
    let metre = |feature: &Value| {
        let ring: Vec<[f64; 2]> =
            serde_json::from_value(feature["geometry"]["coordinates"][0].clone()).expect("a ring");
        let middle = |axis: usize| ring.iter().take(4).map(|corner| corner[axis]).sum::<f64>() / 4.0;
        let (east, north) = ((middle(0) - LONGITUDE) * east_m, (middle(1) - LATITUDE) * north_m);
        let y_m = feature["properties"]["y_m"].as_f64().expect("its place");
        (y_m, (east - y_m * sin).hypot(north - y_m * cos), feature["properties"].clone())
    };
    features.iter().map(metre).collect()
}

/// A map in GeoJSON of the recording, with these flags.
fn mapped(flags: &[&str]) -> Vec<(f64, f64, Value)> {
    let (_, scene, file) = recording();
    let folder = tempfile::tempdir().expect("a folder");
    let map = folder.path().join("map.geojson");
    let ended = run(&[&["estimate", text(file), "--rig", text(scene), "--map", text(&map)], flags].concat());
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    metres(&map)
}

#[test]
fn metres_lie_where_the_scene_has_them() {
    let by_receiver = mapped(&[]);
    assert!(by_receiver.len() >= 12, "{} metres", by_receiver.len());
    for (y_m, off_m, properties) in &by_receiver {
        // Noise of 2 cm, and what the tractor goes in the time from a scan to its telegram.
        assert!(*off_m < 0.06, "{y_m} m: {off_m} m off");
        assert_eq!(properties["gnss_quality"], 4.0, "{properties}");
    }
    let known = by_receiver.iter().filter(|(_, _, properties)| properties["leaf_area_m2"].is_number());
    assert!(known.count() >= 10, "leaf areas of the metres");
    // An antenna that is a metre from where it is said to be.
    let wrong = mapped(&["--antenna", "-0.1,0.6"]);
    assert!(wrong.iter().all(|(_, off_m, _)| (0.9..1.1).contains(off_m)), "{wrong:?}");
}

#[test]
fn a_stated_row_lies_where_it_is_stated() {
    let stated = mapped(&["--map-from", "41.6,0.84,30"]);
    for (y_m, off_m, properties) in &stated {
        assert!(*off_m < 1e-6 && properties["gnss_quality"].is_null(), "{y_m} m: {off_m} m off");
    }
}

#[test]
fn every_format_is_written_and_the_same_every_time() {
    let (_, scene, file) = recording();
    let folder = tempfile::tempdir().expect("a folder");
    let made = |times: usize| {
        let names = ["geojson", "gpkg", "parquet", "tif"];
        let paths = names.map(|ending| folder.path().join(format!("map{times}.{ending}")));
        let flags: Vec<&str> = paths.iter().flat_map(|path| ["--map", text(path)]).collect();
        let ended = run(&[&["estimate", text(file), "--rig", text(scene)], &flags[..]].concat());
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        paths.map(|path| fs::read(path).expect("written"))
    };
    let (once, again) = (made(1), made(2));
    assert!(once == again && once.iter().all(|bytes| bytes.len() > 1000));
}

#[test]
fn what_has_no_place_is_refused_with_the_remedy() {
    let (folder, scene, file) = recording();
    // The scans alone.
    let scans = folder.path().join("scans.csv");
    let ended = run(&["export", text(file), "--to", "csv", "--what", "scans", "-o", text(&scans)]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let map = folder.path().join("none.gpkg");
    let rest = ["--rig", text(scene), "--map", text(&map)];
    let ended = run(&[&["estimate", text(&scans)], &rest[..]].concat());
    assert_eq!(ended.code, Some(2), "{}", ended.stdout);
    assert_says(&ended.stderr, &["scans.csv", "no position", "GGA", "--map-from"]);
    assert!(!map.exists());
    let live = refused(&[&["estimate", "tcp://127.0.0.1:9"], &rest[..]].concat());
    assert_says(&live, &["is live", "rowscan record", "--map-from"]);
    // One stated row for the rows on both sides, in any order of the scanners.
    let both = folder.path().join("both.toml");
    let scanner = |side: &str| format!("[[rig.scanner]]\nmodel = \"lms111\"\nrow = \"{side}\"\n");
    for sides in [["right", "left"], ["left", "right"], ["right", "right"]] {
        let one_scanner = SCENE.split_once("[[rig.scanner]]").expect("a scanner").0;
        fs::write(&both, format!("{one_scanner}{}{}", scanner(sides[0]), scanner(sides[1])))
            .expect("written");
        let sources = [text(file), text(file), "--scanner", "0", "--scanner", "1"];
        let flags = ["--rig", text(&both), "--map", text(&map), "--map-from", "41.6,0.84,30"];
        let ended = run(&[&["estimate"], &sources[..], &flags[..]].concat());
        let is_refused = ended.stderr.contains("--map-from says where one row lies");
        assert_eq!(is_refused, sides[0] != sides[1], "{sides:?}: {}", ended.stderr);
    }
    let name = refused(&["estimate", text(file), "--rig", text(scene), "--map", "map.shp"]);
    assert_says(&name, &["map.shp", ".gpkg", ".tif"]);
}
