//! Two passes of one row, from both of its alleys, as one estimate.

use std::path::Path;

use serde_json::Value;

use crate::common::binary::{Ended, Telling, assert_says, run, text};

/// Two trees of leaves as they are, seen by the device's optics; the scanner looks to this side.
fn scene(row: &str, more: &str) -> String {
    format!(
        "version = 2\nseed = 5\n[orchard]\ntrees = 4\n[orchard.tree]\niterations = 7\n{more}\n[[rig.scanner]]\nmodel = \"lms111\"\nrow = \"{row}\"\n"
    )
}

/// Drives along the row of this scene once, and keeps it.
fn recorded(folder: &Path, name: &str, scene: &str) -> [String; 2] {
    let [rig, file] =
        ["toml", "mcap"].map(|end| folder.join(format!("{name}.{end}")).to_str().expect("UTF-8").to_owned());
    std::fs::write(&rig, scene).expect("written");
    let mut emulator =
        Telling::start("emulate", &[&rig, "--tcp", "127.0.0.1:0", "--time-scale", "0.5", "--length", "6"]);
    let source = format!("tcp://{}", emulator.address());
    let ended = run(&["estimate", &source, "--rig", &rig, "--length", "5.9", "--record", &file]);
    assert!(Path::new(&file).exists(), "{name}: {}", ended.stderr);
    [rig, file]
}

fn json(ended: &Ended) -> Value {
    serde_json::from_str(&ended.stdout).unwrap_or_else(|_| panic!("{}", ended.stderr))
}

fn codes(told: &Value) -> Vec<String> {
    let warnings = told["warnings"].as_array().expect("a list");
    let code = |warning: &Value| warning.as_str().and_then(|text| Some(text.split_once(':')?.0.to_owned()));
    warnings.iter().filter_map(code).collect()
}

#[test]
fn a_pass_from_the_other_alley_shows_what_was_hidden_and_one_that_lies_elsewhere_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let [right, out] = recorded(folder.path(), "right", &scene("right", ""));
    let [left, other] = recorded(folder.path(), "left", &scene("left", ""));
    let joined = |more: &[&str]| {
        let args = ["estimate", &out, "--rig", &right, "--format", "json"];
        run(&[&args[..], more].concat())
    };
    let from_other = ["--other-side", other.as_str(), "--other-rig", left.as_str()];
    let one = json(&joined(&[]));
    assert_eq!(one["other_side"], Value::Null, "one pass says nothing of another");
    let both = json(&joined(&from_other));
    let sides = &both["other_side"];
    assert_eq!(
        (&sides["opposite"], &sides["slices_alone"]),
        (&Value::Bool(true), &Value::from(0)),
        "{sides}"
    );
    let hidden = |told: &Value| told["contact"]["voxels_unvisited"].as_u64().expect("a count");
    assert!(hidden(&both) * 4 < hidden(&one), "{} {}", hidden(&both), hidden(&one));
    assert!(sides["correlation"].as_f64() > Some(0.2), "{sides}");
    assert!(!codes(&both).iter().any(|code| code.starts_with("sides")), "{:?}", codes(&both));
    // The impacted area is of this pass.
    assert_eq!(both["impacted_total_area_m2"], one["impacted_total_area_m2"]);
    assert_ne!(both["leaf_area_m2"], one["leaf_area_m2"]);

    // It began a metre farther on: told, and by how much.
    let shifted = json(&joined(&[&from_other[..], &["--other-start", "1"]].concat()));
    assert!(codes(&shifted).contains(&"sides_shifted".to_owned()), "{:?}", codes(&shifted));
    let shift_m = shifted["other_side"]["shift_m"].as_f64().expect("told");
    assert!((shift_m + 1.0).abs() <= 0.5, "{shift_m}");
    let apart = json(&joined(&[&from_other[..], &["--other-start", "100"]].concat()));
    assert!(codes(&apart).contains(&"sides_apart".to_owned()), "{:?}", codes(&apart));
    assert_eq!(apart["leaf_area_m2"], one["leaf_area_m2"], "nothing was joined");

    // What cannot be joined is refused.
    for (args, words) in [
        (&["--other-side", "tcp://127.0.0.1:9"][..], &["--other-side must be a recording"][..]),
        (&["--other-side", &other, "--other-back"], &["--other-start"]),
        (
            &["--other-side", &other, "--other-start", "far"],
            &["expected metres along the row", "or gnss", "`far`"],
        ),
        (&["--other-side", "nowhere.mcap"], &["nowhere.mcap"]),
    ] {
        let ended = joined(args);
        assert_eq!(ended.code, Some(2), "{args:?}: {}", ended.stderr);
        assert_says(&ended.stderr, words);
    }
    let two = run(&["estimate", &out, &out, "--rig", &right, "--other-side", &other]);
    assert_eq!(two.code, Some(2), "{}", two.stderr);
    assert_says(&two.stderr, &["one source", "found 2"]);
}

#[test]
fn a_rig_that_names_other_optics_than_its_scene_casts_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("row.toml").to_str().expect("UTF-8").to_owned();
    for (rig, stages, told) in [
        ("device", "ideal", true),
        ("device", "device", false),
        ("ideal", "ideal", false),
        ("ideal", "spot", true),
    ] {
        let more = format!("[optics]\nstages = \"{stages}\"\n[rig]\noptics = \"{rig}\"");
        std::fs::write(&file, scene("right", &more)).expect("written");
        let ended = run(&["orchard", "truth", &file]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        assert_eq!(ended.stderr.contains("`[rig] optics"), told, "{rig} {stages}: {}", ended.stderr);
    }
}

/// A pass whose recording holds a receiver of 2 cm beside the scans: along this side of the row, from so far along it, of a field at this longitude.
fn received(folder: &Path, name: &str, (row, start_m, longitude_deg): (&str, f64, f64)) -> [String; 2] {
    let gnss = format!(
        "[gnss]\nlatitude_deg = 41.6\nlongitude_deg = {longitude_deg}\nazimuth_deg = 30.0\nnoise_m = 0.02\nrate_hz = 10\n[rig]\nstart_m = {start_m}\n"
    );
    let rig = folder.join(format!("{name}.toml"));
    std::fs::write(&rig, scene(row, &gnss)).expect("written");
    let scenario = folder.join(format!("drive_{name}.toml"));
    std::fs::write(
        &scenario,
        format!(
            r#"version = 1
scene = "{name}.toml"
seed = 5
clock = {{ mode = "lockstep", ack = {{ sut = "idle" }}, deadline_wall_s = 60 }}
end = {{ row_m = 6 }}
device = [{{ id = "it", model = "lms111" }}]
nmea = [{{ id = "gnss", port = "tcp:127.0.0.1:0" }}]
run = [{{ id = "sut", command = ["{{rowscan}}", "estimate", "tcp://{{it.tcp}}", "--wait", "--rig", "{{scenario}}/{name}.toml"], ready = {{ line = "connected" }} }}]
expect = [{{ what = "scans_lost", equals = 0 }}]
"#
        ),
    )
    .expect("written");
    let keep = folder.join(format!("kept_{name}"));
    let ended = run(&["check", text(&scenario), "--keep", text(&keep)]);
    assert_eq!(ended.code, Some(0), "{}{}", ended.stdout, ended.stderr);
    let kept =
        std::fs::read_dir(&keep).expect("kept").next().expect("one scenario").expect("a folder").path();
    let file = kept.join("seed-5-run-1/run.mcap");
    assert!(file.exists(), "{}", file.display());
    [text(&rig).to_owned(), text(&file).to_owned()]
}

/// Nobody measures where a pass began: the receivers of both know.
#[test]
fn the_receivers_place_a_pass_along_the_row_and_know_another_row() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    let [right, out] = received(here, "right", ("right", 0.0, 0.84));
    let [left, other] = received(here, "left", ("left", 1.5, 0.84));
    // The rig that the user has of that pass does not say where it began.
    let silent = here.join("silent.toml");
    let told = std::fs::read_to_string(&left).expect("written");
    std::fs::write(&silent, told.replace("start_m = 1.5\n", "")).expect("written");
    let joined = |more: &[&str]| {
        let args = ["estimate", &out, "--rig", &right, "--format", "json", "--other-rig", text(&silent)];
        run(&[&args[..], more].concat())
    };
    let ended = joined(&["--other-side", &other, "--other-start", "gnss"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let start_m = ended
        .stderr
        .split_once(" began ")
        .and_then(|(_, rest)| rest.split_once(" m along the row and went on"));
    let start_m: f64 = start_m.unwrap_or_else(|| panic!("{}", ended.stderr)).0.parse().expect("metres");
    assert!((start_m - 1.5).abs() < 0.1, "{start_m}");
    let both = json(&ended);
    assert!(both["other_side"]["correlation"].as_f64() > Some(0.2), "{}", both["other_side"]);
    assert!(!codes(&both).iter().any(|code| code.starts_with("sides")), "{:?}", codes(&both));
    // The wrong twin: by its rig it began with this one.
    let wrong = json(&joined(&["--other-side", &other]));
    assert!(codes(&wrong).contains(&"sides_shifted".to_owned()), "{:?}", codes(&wrong));
    // The wrong antenna shows in how far the axes lie apart: 4 m and more are another row.
    let [_, elsewhere] = received(here, "elsewhere", ("left", 1.5, 0.8401));
    let none = recorded(here, "none", &scene("left", ""));
    for (args, words) in [
        (
            &["--other-side", &elsewhere, "--other-start", "gnss"][..],
            &["passed another row", "m to the right"][..],
        ),
        (&["--other-side", &none[1], "--other-start", "gnss"], &["no position", "--other-start METRES"]),
        (&["--other-side", &other, "--other-start", "gnss", "--other-back"], &["leave --other-back out"]),
        (&["--other-side", &other, "--antenna", "0,0"], &["--other-start gnss", "found none"]),
    ] {
        let ended = joined(args);
        assert_eq!(ended.code, Some(2), "{args:?}: {}", ended.stderr);
        assert_says(&ended.stderr, words);
    }
}
