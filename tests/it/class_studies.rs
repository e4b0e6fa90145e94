//! Studies over classes, error budgets, and what is told of a row outside its class, on the command line.

use crate::common;

use std::path::{Path, PathBuf};

use common::binary::{Ended, run, text};
use serde_json::Value;

/// Two classes of small trees, in rows long enough for blocks.
const SMALL: &str = r#"
version = 1
name = "small"
scene = "small.toml"

[[axis]]
name = "leaf_angle"

[[axis.class]]
name = "as grown"

[[axis.class]]
name = "flat"
set = { "orchard.tree.leaf_angle" = "beta", "orchard.tree.leaf_angle_mean_deg" = 20.0, "orchard.tree.leaf_angle_sd_deg" = 8.0 }

[[axis]]
name = "rig_error"

[[axis.class]]
name = "none"

[[axis.class]]
name = "told too far"
told = { "rig.scanner.distance_m" = 2.4 }
"#;

const SCENE: &str = r#"
version = 1
name = "small"

[orchard]
trees = 6
[orchard.tree]
iterations = 6

[rig]
speed_m_s = 2.0
[[rig.scanner]]
model = "lms111"
"#;

fn write(folder: &Path, name: &str, content: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, content).expect("written");
    path
}

fn json(ended: &Ended) -> Value {
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    serde_json::from_str(&ended.stdout).expect("json")
}

#[test]
fn calibrations_are_carried_between_classes_in_parts_as_in_one() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "small.toml", SCENE);
    let classes = write(folder.path(), "classes.toml", SMALL);
    let study = |more: &[&str]| {
        run(&[&["study", "transfer", "--rows", "6", "--classes", text(&classes)][..], more].concat())
    };
    let whole = json(&study(&["--format", "json"]));
    let files: Vec<PathBuf> = (1..=2)
        .map(|shard| {
            let file = folder.path().join(format!("{shard}.json"));
            let ended = study(&["--shard", &format!("{shard}/2"), "--output", text(&file)]);
            assert_eq!(ended.code, Some(0), "{}", ended.stderr);
            file
        })
        .collect();
    let csv = folder.path().join("between.csv");
    let merged = run(&[
        "study",
        "merge",
        "--format",
        "json",
        "--between-class",
        text(&csv),
        text(&files[0]),
        text(&files[1]),
    ]);
    assert_eq!(json(&merged), whole);

    let bias = |train: &str, test: &str, estimator: &str| {
        let cells = whole["matrix"].as_array().expect("cells");
        let own = |c: &&Value| c["train"] == train && c["test"] == test && c["estimator"] == estimator;
        cells.iter().find(own).expect("a cell")["bias"].as_f64().expect("a number")
    };
    // Flat leaves show a scanner beside them less of their area: what knows only the others makes too little of them.
    let (there, back) = (bias("as grown", "flat", "contact"), bias("flat", "as grown", "contact"));
    assert!(there < -0.05 && back > 0.05, "{there} {back}");
    assert!(bias("as grown", "as grown", "contact").abs() < there.abs());
    let left_out = whole["left_out"].as_array().expect("rows");
    assert!(left_out.iter().any(|row| row["estimator"] == "null" && row["test"] == "told too far"));
    let table = std::fs::read_to_string(&csv).expect("written");
    assert!(table.contains("leaf_angle,contact,") && !table.contains("rig_error"), "{table}");
}

#[test]
fn coverage_is_counted_class_by_class() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "small.toml", SCENE);
    let classes = write(folder.path(), "classes.toml", SMALL);
    let study = ["study", "coverage", "--rows", "5", "--axes", "leaf_angle", "--format", "json", "--classes"];
    let found = json(&run(&[&study[..], &[text(&classes)]].concat()));
    let rows = found["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 2);
    for row in rows {
        assert_eq!(row["n"], 5);
        let held = &row["interval_holds"];
        let number = |key: &str| held[key].as_f64().expect(key);
        assert!(number("low") < number("high") && number("share") <= number("high"), "{row}");
        assert!(number("share") >= row["sampling_holds"]["share"].as_f64().expect("a share"), "{row}");
    }
    let wrong = run(&[&study[..], &[text(&classes), "--axes", "leaf_angel"]].concat());
    assert!(
        wrong.code == Some(2) && wrong.stderr.contains("there are leaf_angle, rig_error"),
        "{}",
        wrong.stderr
    );
}

/// A calibration's file that changes between parts of a study: parts made with either do not stand together, nor does one part's own beginning.
#[test]
fn parts_that_were_made_with_other_calibrations_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name);
    let rig = format!("[rig]\ncalibration = '{}'\n", text(&file("own.toml")));
    write(folder.path(), "small.toml", &SCENE.replace("[rig]\n", &rig));
    let classes = write(folder.path(), "classes.toml", SMALL);
    let made = |seeds: &str| {
        let (scene, own) = (file("small.toml"), file("own.toml"));
        let ended = run(&["study", "calibration", text(&scene), "--seeds", seeds, "-o", text(&own)]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    };
    let shard = |number: u32| {
        let (part, out) = (format!("{number}/2"), file(&format!("{number}.json")));
        let study = ["study", "coverage", "--rows", "2", "--axes", "leaf_angle", "--classes", text(&classes)];
        run(&[&study[..], &["--shard", &part, "-o", text(&out), "--resume"]].concat())
    };
    let merged = || run(&["study", "merge", text(&file("1.json")), text(&file("2.json"))]);
    // One that is named and cannot be read is not none.
    let unread = shard(1);
    assert!(unread.code == Some(2) && unread.stderr.contains("own.toml"), "{}", unread.stderr);
    std::fs::remove_file(file("1.json.journal")).expect("begun");
    made("1..3");
    assert_eq!((shard(1).code, shard(2).code, merged().code), (Some(0), Some(0), Some(0)));
    std::fs::remove_file(file("2.json")).expect("written");
    made("4..6");
    assert_eq!(shard(2).code, Some(0));
    let refused = merged();
    assert!(refused.code == Some(2) && refused.stderr.contains("calibrations"), "{}", refused.stderr);
}

#[test]
fn a_budget_adds_up_on_every_row() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = write(folder.path(), "small.toml", SCENE);
    let found = json(&run(&["study", "budget", text(&scene), "--seeds", "1..2", "--format", "json"]));
    let rows = found["rows"].as_array().expect("rows");
    assert!(rows.len() >= 2 * 4, "contact_raw, voxel, polar and gap of two rows: {}", rows.len());
    for row in rows {
        let number = |key: &str| row[key].as_f64().expect(key);
        let terms: f64 = row["terms_m2"].as_array().expect("terms").iter().filter_map(Value::as_f64).sum();
        let error = number("estimate_m2") - number("truth_m2");
        assert!((terms + number("rest_m2") - error).abs() < 1e-9 * number("truth_m2"), "{row}");
    }
}

#[test]
fn demo_warns_of_leaves_that_the_estimate_does_not_hold_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let flat = format!("{SCENE}\n").replace(
        "iterations = 6",
        "iterations = 6\nleaf_angle = \"beta\"\nleaf_angle_mean_deg = 20.0\nleaf_angle_sd_deg = 8.0",
    );
    let scene = write(folder.path(), "flat.toml", &flat);
    let found = json(&run(&["demo", text(&scene), "--format", "json"]));
    let warnings = found["estimate"]["warnings"].as_array().expect("warnings");
    let told = |start: &str| warnings.iter().any(|w| w.as_str().is_some_and(|w| w.starts_with(start)));
    assert!(told("class: leaf_angle is 20°"), "{warnings:?}");
    let interval = found["estimate"]["leaf_area_interval_m2"].as_array().expect("an interval");
    assert!(interval.iter().all(Value::is_number));
}

/// Young trees in the gaps of a row are no full ones: by a law that is steeper than a line, old trees beside them are told too low, and the interval knows.
#[test]
fn the_interval_of_a_replanted_row_reaches_to_its_leaves() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("row.toml");
    let told = |places: &str| {
        let scene = format!(
            "version = 2\nseed = 7\n[orchard]\npreset = \"spindle\"\n{places}[rig]\ncalibration = \"spindle\"\n[[rig.scanner]]\nmodel = \"lms111\"\n"
        );
        std::fs::write(&path, scene).expect("written");
        let ended = run(&["demo", path.to_str().expect("UTF-8"), "--optics", "ideal", "--format", "json"]);
        let told: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
        let found = &told["estimate"];
        let end = |end: usize| found["leaf_area_interval_m2"][end].as_f64().expect("an interval");
        let uneven = found["leaf_area_uncertainty"]["uneven"].as_f64().expect("a shift");
        (uneven, [end(0), end(1)], told["truth"]["leaf_area_m2"].as_f64().expect("a truth"))
    };
    for (places, least, most) in [
        ("", 0.0, 0.01),
        ("missing = [1, 4, 5, 8, 9]\n", 0.0, 0.01),
        ("replanted = [2, 5, 6]\n", 0.05, 0.1),
        ("replanted = [1, 4, 5, 8, 9]\n", 0.1, 0.2),
    ] {
        let (uneven, [low, high], truth) = told(places);
        assert!((least..most).contains(&uneven), "{places}: {uneven}");
        assert!(low < truth && truth < high, "{places}: {low} {truth} {high}");
        // The wrong twin: without that shift two of these rows lie outside.
        assert_eq!(high * (-uneven).exp() < truth, least > 0.0, "{places}: {high} {truth}");
    }
}
