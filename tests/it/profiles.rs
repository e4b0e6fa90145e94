//! `estimate --profile`: the canopy by height, in every format, and the truth beside it.

use std::path::Path;

use serde_json::Value;

use crate::common::binary::{Emulator, Ended, assert_says, refused, run, text};

/// Six trees, 9 m of row, seen like this.
fn scene(preset: &str, stages: &str, optics: &str) -> String {
    format!(
        "version = 2\nseed = 11\n[orchard]\npreset = \"{preset}\"\ntrees = 6\n[optics]\nstages = \"{stages}\"\n[rig]\noptics = \"{optics}\"\n\
         calibration = \"spindle\"\n[[rig.scanner]]\nmodel = \"lms111\"\n"
    )
}

/// The scene's file, and so many scans of it.
fn recorded(folder: &Path, name: &str, scene: &str, scans: &str) -> [String; 2] {
    let [rig, file] = ["toml", "mcap"].map(|end| text(&folder.join(format!("{name}.{end}"))).to_owned());
    std::fs::write(&rig, scene).expect("written");
    let emulator = Emulator::start(&[&rig, "--time-scale", "max"]);
    let ended = run(&["record", &emulator.url(), "-o", &file, "--scans", scans]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    [rig, file]
}

fn json(ended: &Ended) -> Value {
    serde_json::from_str(&ended.stdout).unwrap_or_else(|_| panic!("{}", ended.stderr))
}

fn bands(told: &Value) -> &Vec<Value> {
    told.as_array().expect("a list of bands")
}

fn sum(told: &Value, key: &str) -> f64 {
    bands(told).iter().filter_map(|band| band[key].as_f64()).sum()
}

/// The root mean square of a profile's error over the root mean square of its truth.
fn off(found_m2: &[f64], truth_m2: &[f64]) -> f64 {
    let errors: f64 = found_m2.iter().zip(truth_m2).map(|(found, truth)| (found - truth).powi(2)).sum();
    (errors / truth_m2.iter().map(|truth| truth * truth).sum::<f64>()).sqrt()
}

#[test]
fn bands_add_up_and_stand_beside_their_truth() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, preset, stages, optics, within) in [
        ("rays", "spindle", "ideal", "ideal", 0.2),
        ("eye", "spindle", "device", "device", 0.35),
        ("other", "mature", "ideal", "ideal", 0.25),
    ] {
        let [rig, file] = recorded(folder.path(), name, &scene(preset, stages, optics), "450");
        let estimate = ["estimate", file.as_str(), "--rig", &rig];
        let told = |more: &[&str]| run(&[&estimate[..], &["--profile", "0.25"], more].concat());
        let beside = json(&told(&["--truth", "--format", "json"]));
        let profile = &beside["profile"];
        let row_m2 = beside["leaf_area_m2"].as_f64().expect("a leaf area");
        assert!((sum(&profile["row"], "leaf_area_m2") / row_m2 - 1.0).abs() < 1e-9, "{name}: {profile}");
        let trees = bands(&profile["trees"]);
        assert_eq!(trees.len(), bands(&beside["trees"]).len(), "{name}");
        for (bands, tree) in trees.iter().zip(beside["trees"].as_array().expect("trees")) {
            let tree_m2 = tree["leaf_area_m2"].as_f64().expect("a leaf area");
            assert!(
                (sum(&bands["bands"], "leaf_area_m2") - tree_m2).abs() < 1e-9 * row_m2,
                "{name}: {bands}"
            );
        }
        let of = |key: &str| -> Vec<f64> {
            bands(&profile["row"]).iter().map(|band| band[key].as_f64().unwrap_or(0.0)).collect()
        };
        let (found_m2, truth_m2) = (of("leaf_area_m2"), of("truth_leaf_area_m2"));
        assert!(off(&found_m2, &truth_m2) < within, "{name}: {found_m2:?} {truth_m2:?}");
        // The wrong twins: one band too low, one too high.
        let twins = [&found_m2[1..], &[&[0.0][..], &found_m2].concat()[..]].map(|twin| off(twin, &truth_m2));
        assert!(twins.iter().all(|twin| *twin > within), "{name}: {twins:?} must be found out");

        // Without the truth, and without a profile, nothing else differs.
        let mut plain = json(&told(&["--format", "json"]));
        assert_eq!(plain["profile"]["row"][0].get("truth_leaf_area_m2"), None, "{name}");
        plain.as_object_mut().expect("an object").remove("profile");
        assert_eq!(plain, json(&run(&[&estimate[..], &["--format", "json"]].concat())), "{name}");
    }
}

#[test]
fn a_line_of_csv_is_a_band_and_the_table_has_those_of_the_row() {
    let folder = tempfile::tempdir().expect("a folder");
    let [rig, file] = recorded(folder.path(), "row", &scene("spindle", "ideal", "ideal"), "450");
    let args = ["estimate", file.as_str(), "--rig", &rig, "--profile", "0.5"];
    let told = |more: &[&str]| {
        let ended = run(&[&args[..], more].concat());
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        ended.stdout
    };
    let document: Value = serde_json::from_str(&told(&["--format", "json"])).expect("JSON");
    let row = bands(&document["profile"]["row"]).len();
    for more in [&[][..], &["--truth"]] {
        let lines = told(&[&["--format", "csv", "--by", "band"], more].concat());
        let mut read = csv::Reader::from_reader(lines.as_bytes());
        let names = read.headers().expect("a header").clone();
        let at = |name: &str| names.iter().position(|known| known == name);
        let (tree, leaf, warnings) =
            (at("tree").expect("tree"), at("leaf_area_m2").expect("leaf"), at("warnings"));
        assert!(warnings.is_some() && at("truth_leaf_area_m2").is_some() != more.is_empty(), "{names:?}");
        let records: Vec<csv::StringRecord> = read.records().map(|record| record.expect("a line")).collect();
        assert_eq!(records.len(), row * (1 + bands(&document["trees"]).len()), "the row and its trees");
        let of_row: f64 = records
            .iter()
            .filter(|record| record[tree].is_empty())
            .filter_map(|record| record[leaf].parse::<f64>().ok())
            .sum();
        let row_m2 = document["leaf_area_m2"].as_f64().expect("a leaf area");
        assert!((of_row / row_m2 - 1.0).abs() < 1e-6, "{of_row} {row_m2}");
    }
    assert_says(
        &told(&["--truth"]),
        &["from m", "porosity", "true m²", "sampling error m²", "bands of the row"],
    );

    // Too short a row for intervals: told, and the bands are there all the same.
    let short: Value = serde_json::from_str(&told(&["--scans", "200", "--format", "json"])).expect("JSON");
    assert!(short["warnings"].to_string().contains("too_few_blocks: "), "{}", short["warnings"]);
    assert!(bands(&short["profile"]["row"]).iter().all(|band| band["leaf_area_sampling_error_m2"].is_null()));
    assert!(sum(&short["profile"]["row"], "leaf_area_m2") > 0.0);
    assert!(!document["warnings"].to_string().contains("too_few_blocks"), "{}", document["warnings"]);

    // What is withheld of the row is withheld of its bands, and is an empty cell.
    let blind = text(&folder.path().join("blind.toml")).to_owned();
    std::fs::write(&blind, "version = 2\n[rig]\nspeed_m_s = 1.0\n[[rig.scanner]]\nmodel = \"lms111\"\n")
        .expect("written");
    let withheld = run(&["estimate", &file, "--rig", &blind, "--profile", "0.5", "--format", "json"]);
    let withheld = json(&withheld);
    assert!(!bands(&withheld["profile"]["row"]).is_empty(), "{withheld}");
    assert!(bands(&withheld["profile"]["row"]).iter().all(|band| band["leaf_area_m2"].is_null()));

    for (args, words) in [
        (&["--rig", rig.as_str(), "--profile", "0.05"][..], &["0.1 to 0.5", "0.05"][..]),
        (&["--rig", &rig, "--profile", "high"], &["0.1 to 0.5", "high"]),
        (&["--profile", "0.25"], &["--rig"]),
        (&["--rig", &rig, "--truth"], &["--profile"]),
        (&["--rig", &rig, "--seed", "3"], &["--estimators"]),
        (&["--rig", &rig, "--format", "csv", "--by", "band"], &["--profile"]),
    ] {
        assert_says(&refused(&[&["estimate", file.as_str()], args].concat()), words);
    }
}
