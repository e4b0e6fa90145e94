//! Two passes of one row, from both of its alleys, as one estimate.

use std::path::Path;

use serde_json::Value;

use crate::common::binary::{Ended, Telling, assert_says, run};

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
        (&["--other-side", &other, "--other-start", "far"], &["expected metres along the row", "`far`"]),
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
