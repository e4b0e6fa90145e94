//! From telegram to estimate and bus: what is not valid is left out, counted by cause and never told as 0.

use crate::common;

use std::fmt::Write as _;

use common::binary::{assert_says, run};
use rowscan_protocol::frame::{Dialect, encode};
use serde_json::Value;

/// What a telegram says beside its counter.
#[derive(Clone, Copy)]
struct Said {
    status: &'static str,
    layer: &'static str,
    scale: u32,
    start: i32,
    step: u16,
    range_mm: u16,
}

const GOOD: Said =
    Said { status: "0 0", layer: "0", scale: 0x3F80_0000, start: 300_000, step: 20_000, range_mm: 1800 };

/// Of the scanner above the ground: a rig's own.
const HEIGHT_MM: f64 = 1600.0;

/// 60 beams of 2° about the row, one telegram every 20 ms.
fn telegram(counter: u16, said: Said) -> Vec<u8> {
    let Said { status, layer, scale, start, step, range_mm } = said;
    let time = u32::from(counter) * 20_000;
    let mut body = format!(
        "sSN LMDscandata 1 1 16F4C7A {status} {counter:X} {counter:X} {time:X} {time:X} 0 0 4 0 {layer} 1388 168 0 1 DIST1 {scale:08X} 00000000 \
         {start:08X} {step:X} 3C"
    );
    // Neighbours lie at other depths, and half of the beams pass, as in foliage: what lies in one plane is a wall, and what nothing passes holds more
    // leaves than any orchard. They stand about the row's axis on level ground. 0 is a beam without an echo.
    for beam in 0..60_u16 {
        let (up, across) = (f64::from(beam) * 2.0 - 60.0).to_radians().sin_cos();
        let passes = range_mm == 0 || beam % 2 == 1;
        let leaf_mm = if passes { f64::INFINITY } else { f64::from(range_mm + beam % 4 * 40) / across };
        let ground_mm = if range_mm > 0 && up < 0.0 { HEIGHT_MM / -up } else { f64::INFINITY };
        let met_mm = leaf_mm.min(ground_mm);
        let told_mm = if met_mm < 20_000.0 { met_mm as u16 } else { 0 };
        write!(body, " {told_mm:X}").expect("a string takes it");
    }
    body.push_str(" 0 0 0 0 0 0");
    let mut bytes = Vec::new();
    encode(Dialect::A, body.as_bytes(), &mut bytes);
    bytes
}

/// The estimate of a recording of 500 telegrams, told by their number, with its exit code.
fn estimated(said: impl Fn(u16) -> Said) -> (Option<i32>, Value, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = folder.path().join("rig.toml");
    // No calibration: what these scans see is no orchard, and raw leaf areas are withheld nowhere.
    std::fs::write(&rig, RIG).expect("written");
    estimated_by(rig.to_str().expect("UTF-8"), said)
}

const RIG: &str = "[rig]\nspeed_m_s = 1.0\ntree_spacing_m = 1.5\nrow_spacing_m = 4.0\noptics = \"ideal\"\n[[rig.scanner]]\nmodel = \"lms111\"\n";

fn estimated_by(rig: &str, said: impl Fn(u16) -> Said) -> (Option<i32>, Value, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scans.bin");
    let bytes: Vec<u8> = (1..=500).flat_map(|counter| telegram(counter, said(counter))).collect();
    std::fs::write(&path, bytes).expect("written");
    let path = path.to_str().expect("UTF-8");
    let ended = run(&["estimate", path, "--rig", rig, "--format", "json"]);
    let estimate = serde_json::from_str(&ended.stdout).unwrap_or_else(|e| panic!("{e}: {}", ended.stderr));
    (ended.code, estimate, ended.stderr)
}

fn warnings(estimate: &Value) -> String {
    let list = estimate["warnings"].as_array().expect("a list");
    list.iter().map(|warning| format!("{}\n", warning.as_str().expect("text"))).collect()
}

/// Areas that a row has or has not.
const AREAS: [&str; 4] = ["impacted_total_area_m2", "leaf_area_m2", "leaf_area_contact_raw_m2", "lai"];

#[test]
fn numbers_that_cannot_be_give_no_area_and_their_cause() {
    let nan = f32::NAN.to_bits();
    for (what, said, code) in [
        ("scale 0", Said { scale: 0, ..GOOD }, "scale_factor"),
        ("scale NaN", Said { scale: nan, ..GOOD }, "scale_factor"),
        ("scale ∞", Said { scale: f32::INFINITY.to_bits(), ..GOOD }, "scale_factor"),
        ("scale −1", Said { scale: (-1f32).to_bits(), ..GOOD }, "scale_factor"),
        ("scale 1e30", Said { scale: 1e30f32.to_bits(), ..GOOD }, "scale_factor"),
        ("step 0", Said { step: 0, ..GOOD }, "angular_step"),
        ("far away", Said { start: 0x7FFF_0000, ..GOOD }, "field"),
    ] {
        let (exit, estimate, stderr) = estimated(|_| said);
        assert_eq!(exit, Some(1), "{what}: {stderr}");
        assert_eq!((&estimate["scans"], &estimate["telegrams_bad"]), (&0.into(), &500.into()), "{what}");
        for area in AREAS {
            assert!(estimate[area].is_null(), "{what}: {area} = {}", estimate[area]);
        }
        let warnings = warnings(&estimate);
        assert_says(
            &warnings,
            &[&format!("unreadable: 500 scan telegrams gave no scan ({code})"), "nothing_valid"],
        );
        assert_eq!(stderr.matches("gives no scan").count(), 1, "one line a cause, not 500: {stderr}");
    }
}

#[test]
fn a_device_that_cannot_measure_gives_no_area_and_its_cause() {
    for (said, cause) in [
        (Said { status: "0 1", ..GOOD }, "device_error"),
        (Said { status: "1 0", ..GOOD }, "device_error"),
        (Said { status: "0 4", ..GOOD }, "contamination, the window"),
        (Said { start: -900_000, ..GOOD }, "outside_field"),
    ] {
        let (exit, estimate, stderr) = estimated(|_| said);
        assert_eq!((exit, &estimate["scans_excluded"]), (Some(1), &500.into()), "{stderr}");
        assert!(AREAS.iter().all(|area| estimate[area].is_null()), "{estimate}");
        assert_says(&warnings(&estimate), &["excluded: 500 scans were left out", cause, "nothing_valid"]);
    }
}

#[test]
fn misses_and_a_warning_are_data() {
    let (exit, estimate, _) = estimated(|_| Said { range_mm: 0, ..GOOD });
    assert_eq!((exit, &estimate["leaf_area_m2"]), (Some(0), &0.0.into()), "a gap in the row is a true zero");
    let (exit, clean, _) = estimated(|_| GOOD);
    assert_eq!(exit, Some(0));
    let (exit, dirty, _) = estimated(|_| Said { status: "0 2", ..GOOD });
    assert_eq!((exit, &dirty["leaf_area_m2"]), (Some(0), &clean["leaf_area_m2"]));
    assert_says(
        &warnings(&dirty),
        &["contamination_warning: the device warns of a dirty window in 500 scans"],
    );
}

#[test]
fn a_stretch_without_valid_scans_withholds_areas_only_if_it_is_too_long() {
    let (_, whole, _) = estimated(|_| GOOD);
    let with_bad = |bad: std::ops::Range<u16>, said: Said| {
        estimated(move |counter| if bad.contains(&counter) { said } else { GOOD })
    };
    for bad in [Said { status: "0 1", ..GOOD }, Said { scale: 0, ..GOOD }] {
        // Four lines: their neighbours fill the gap, to the last square millimetre of a wall.
        let (exit, estimate, _) = with_bad(200..204, bad);
        let area = |estimate: &Value| estimate["impacted_total_area_m2"].as_f64().expect("a number");
        assert_eq!(exit, Some(0));
        assert!((area(&estimate) / area(&whole) - 1.0).abs() < 1e-9, "{} {}", area(&estimate), area(&whole));
        // A tenth of the row.
        let (exit, estimate, _) = with_bad(200..250, bad);
        assert!(estimate["impacted_total_area_m2"].is_null(), "{estimate}");
        assert_eq!(exit, Some(1));
        assert_says(&warnings(&estimate), &["too_much_excluded: 10", "max_excluded allows 5.0 %"]);
    }
    // The rig may allow more.
    let folder = tempfile::tempdir().expect("a folder");
    let rig = folder.path().join("rig.toml");
    std::fs::write(
        &rig,
        "[rig]\nmax_excluded = 0.2\noptics = \"ideal\"\n[[rig.scanner]]\nmodel = \"lms111\"\n",
    )
    .expect("written");
    let said = |counter: u16| if (200..250).contains(&counter) { Said { scale: 0, ..GOOD } } else { GOOD };
    let (exit, estimate, stderr) = estimated_by(rig.to_str().expect("UTF-8"), said);
    assert_eq!(exit, Some(0), "{stderr}");
    assert!(estimate["impacted_total_area_m2"].is_number());
}

#[test]
fn scans_of_inclined_layers_are_told_and_not_flattened() {
    let (_, plane, _) = estimated(|_| GOOD);
    // Every fifth scan is of another layer, and sees something nearer.
    let (exit, layers, _) = estimated(|counter| match counter % 5 {
        0 => Said { layer: "FA", range_mm: 900, ..GOOD },
        _ => GOOD,
    });
    assert_eq!(exit, Some(0), "{}", warnings(&layers));
    assert_says(&warnings(&layers), &["other_layer: 100 scans are of inclined layers"]);
    assert_eq!(layers["ranges"]["min_m"], plane["ranges"]["min_m"]);
    let area = |estimate: &Value| estimate["impacted_total_area_m2"].as_f64().expect("a number");
    assert!((area(&layers) / area(&plane) - 1.0).abs() < 0.01, "{} {}", area(&layers), area(&plane));
}

/// What a layer filter leaves that drops the layer which the estimate uses.
#[test]
fn inclined_layers_alone_give_no_area_and_say_which_layer_is_missing() {
    let (exit, estimate, _) =
        estimated(|counter| Said { layer: ["FA", "FE0C", "FF06"][usize::from(counter % 3)], ..GOOD });
    assert_eq!(exit, Some(1));
    assert!(estimate["impacted_total_area_m2"].is_null() && estimate["leaf_area_m2"].is_null());
    assert_says(
        &warnings(&estimate),
        &["nothing_valid", "other_layer: 500 scans are of inclined layers", "ScanLayerFilter"],
    );
}

#[test]
fn a_layers_points_lie_above_the_plane_and_two_layers_make_no_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("layers.bin");
    // −250: a device counts downwards.
    let up = Said { layer: "FF06", ..GOOD };
    std::fs::write(&path, [telegram(1, up), telegram(2, GOOD)].concat()).expect("written");
    let path = path.to_str().expect("UTF-8");
    let ended = run(&["export", path, "--to", "csv", "--what", "points", "-o", "-"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let mut points = csv::Reader::from_reader(ended.stdout.as_bytes());
    let head = points.headers().expect("a header").clone();
    let column = |name: &str| head.iter().position(|column| column == name).expect("the column is there");
    let (z, layer, range) = (column("z_m"), column("layer_deg"), column("range_m"));
    for point in points.records() {
        let point = point.expect("a record");
        let number = |at: usize| point[at].parse::<f64>().expect("a number");
        assert!((number(z) - number(range) * number(layer).to_radians().sin()).abs() < 1e-9, "{point:?}");
    }
    let table = run(&["export", path, "--to", "csv", "--what", "scans", "-o", "-"]);
    assert_eq!(table.code, Some(2));
    assert_says(&table.stderr, &["scan 1 is of the layer 0°, the scans before it of 2.5°", "--what points"]);
}
