//! `rowscan study field`, through the whole binary: virtual defoliation of rows that were scanned through a device.

use rowscan_scenes::files::load_scene;
use rowscan_scenes::{Orchard, TruthGrid};

use crate::common::binary::{Emulator, assert_says, refused, run};
use crate::common::recorded::folder;

/// Scans of three rows, and of each three metres with their true leaf areas: recording, beginning, m².
fn strip(file: &impl Fn(&str) -> String) -> Vec<(String, usize, f64)> {
    let mut stripped = Vec::new();
    for seed in 9401..9404 {
        let name = format!("row-{seed}.mcap");
        let seed_text = seed.to_string();
        let emulator = Emulator::start(&["spindle", "--seed", &seed_text, "--time-scale", "max"]);
        let recorded = run(&["record", &emulator.url(), "-o", &file(&name), "--scans", "500"]);
        assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
        emulator.end();
        let scene = load_scene("spindle", |_| {}).expect("built in");
        let orchard = Orchard::grow(&scene.orchard, seed, &|_, _| {}).expect("it grows");
        let grid = TruthGrid { slab_m: 1.0, ..TruthGrid::default() };
        let slabs = orchard.truth_of_row(0, grid).slabs;
        for metre in [2, 4, 6] {
            stripped.push((name.clone(), metre, slabs[metre].leaf_area_m2));
        }
    }
    stripped
}

#[test]
fn a_calibration_of_measured_metres_is_that_of_the_leaves_and_a_sheet_in_wrong_units_is_refused() {
    let (_folder, file) = folder();
    let sheet = file("field.csv");
    let stripped = strip(&file);
    let fit = |factor: f64| {
        let mut text = String::from("recording,from_m,to_m,leaf_area_m2\n");
        for (recording, metre, leaf_area_m2) in &stripped {
            text.push_str(&format!("{recording},{metre},{},{}\n", metre + 1, leaf_area_m2 * factor));
        }
        std::fs::write(&sheet, text).expect("written");
        run(&["study", "field", &sheet, "--rig", "spindle", "-o", &file("new.toml"), "--format", "json"])
    };
    let ended = fit(1.0);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let found: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
    assert_eq!(found["left_out"], "recording");
    assert_eq!(found["pieces"].as_array().map(Vec::len), Some(9));
    let error = |of: &str, what: &str| found[of][what].as_f64().expect("known");
    // Rays of the class that the shipped calibration was made for: both are near the leaves.
    assert!(error("before", "bias").abs() < 0.1 && error("after", "bias").abs() < 0.1, "{found}");
    assert!(error("after", "rmse") < 0.2, "{found}");
    let new = std::fs::read_to_string(file("new.toml")).expect("written");
    assert!(new.contains("preset = \"field\"") && new.contains("k_sd = "), "{new}");
    let row = file("row-9401.mcap");
    let told =
        run(&["estimate", &row, "--rig", "spindle", "--calibration", &file("new.toml"), "--format", "json"]);
    let told: serde_json::Value = serde_json::from_str(&told.stdout).expect("JSON");
    assert!(told["leaf_area_uncertainty"]["calibration"].as_f64() > Some(0.0), "{told}");
    // A value that is not the file's own any more.
    let changed = new.replacen("k_sd = 0.", "k_sd = 0.00", 1);
    assert_ne!(changed, new);
    std::fs::write(file("changed.toml"), &changed).expect("written");
    let said = refused(&["estimate", &row, "--rig", "spindle", "--calibration", &file("changed.toml")]);
    assert!(said.contains("its values are not those it was made with"), "{said}");
    let own: String = changed
        .lines()
        .filter(|line| !line.starts_with("fingerprint"))
        .map(|line| format!("{line}\n"))
        .collect();
    std::fs::write(file("own.toml"), own).expect("written");
    let own = run(&["estimate", &row, "--rig", "spindle", "--calibration", &file("own.toml")]);
    assert_eq!(own.code, Some(0), "somebody's own values: {}", own.stderr);
    // A recording under two names, and a copy of one: pieces of one row would count as two rows.
    std::fs::copy(&row, file("copy.mcap")).expect("copied");
    for name in ["./row-9401.mcap", "copy.mcap"] {
        std::fs::write(
            file("twice.csv"),
            format!("recording,from_m,to_m,leaf_area_m2\nrow-9401.mcap,2,3,5\n{name},2,3,5\n"),
        )
        .expect("written");
        let said = refused(&["study", "field", &file("twice.csv"), "--rig", "spindle"]);
        assert!(said.contains("have the same contents"), "{said}");
    }
    // dm² in the place of m².
    let wrong = fit(100.0);
    assert_eq!((wrong.code, wrong.stdout.as_str()), (Some(2), ""));
    assert_says(&wrong.stderr, &["times what the scans tell", "in m²"]);
    assert_eq!(std::fs::read_to_string(file("new.toml")).expect("kept"), new, "what was there stays");
}

#[test]
fn sheets_that_name_what_was_not_scanned_are_refused_by_line() {
    let (_folder, file) = folder();
    let sheet = file("field.csv");
    let emulator = Emulator::start(&["spindle", "--time-scale", "max"]);
    let recorded = run(&["record", &emulator.url(), "-o", &file("row.mcap"), "--scans", "100"]);
    assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
    emulator.end();
    for (line, says) in [
        ("row.mcap,0.2,1.7,5", ["line 2: from 0.2 to 1.7 m", "whole metres of the row, or one tree"]),
        ("row.mcap,40,41,5", ["line 2: from 40 to 41 m", "holds scans of 0.0 to"]),
        ("row.mcap,1,2,-5", ["`leaf_area_m2`", "found -5"]),
        ("none.mcap,1,2,5", ["none.mcap", "No such file"]),
        ("row.mcap,0,1,5", ["expected 4 pieces or more", "measure more"]),
    ] {
        std::fs::write(&sheet, format!("recording,from_m,to_m,leaf_area_m2\n{line}\n")).expect("written");
        let said = refused(&["study", "field", &sheet, "--rig", "spindle"]);
        assert_says(&said, &says);
    }
    assert_says(
        &refused(&["study", "field", "--plan", "--rig", "spindle", "--hand-sd", "2"]),
        &["--hand-sd"],
    );
}
