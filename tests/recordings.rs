//! Recorded telegrams of real devices go through the same driver and pipeline. The recordings are read where they lie.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

mod common;

use std::path::Path;
use std::process::Command;

use common::facts;
use serde_json::Value;

fn estimate(recording: &Path) -> Value {
    let run = Command::new(env!("CARGO_BIN_EXE_rowscan"))
        .arg("estimate")
        .arg(recording)
        .args(["--format", "json"])
        .output()
        .expect("it runs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&run.stdout).expect("json")
}

#[test]
fn the_estimate_of_a_real_recording_agrees_with_its_description() {
    let Some(facts) = facts("estimates of real recordings") else { return };
    // Name and the measured rate the facts state: period on the device clock, LMS111 20112 µs, LMS511 40008, TiM781S 66665.
    for (name, period_us) in
        [("lms111_startup_first88", 20_112.0), ("lms511_20210302", 40_008.0), ("tim781s_20210125", 66_665.0)]
    {
        let folder = facts.join("protocol/recordings");
        let about = std::fs::read_to_string(folder.join(format!("{name}.json"))).expect("described");
        let about: Value = serde_json::from_str(&about).expect("json");
        let first = &about["first_scan"]["channels16"][0];
        let found = estimate(&folder.join(format!("{name}.d2h.bin")));

        assert_eq!(found["scans"], about["scan_telegrams"], "{name}");
        assert_eq!(found["scans_repeated"], 0, "{name}");
        assert_eq!(found["telegrams_bad"], 0, "{name}");
        assert_eq!(found["points_per_scan"], first["count"], "{name}");
        let nominal = about["first_scan"]["scan_frequency_1_100Hz"].as_f64().expect("stated") / 100.0;
        assert_eq!(found["scan_frequency_nominal_hz"], nominal, "{name}");
        let measured = found["scan_frequency_hz"].as_f64().expect("measured");
        assert!((measured - 1e6 / period_us).abs() / measured < 0.01, "{name}: {measured} Hz");
        for area in ["impacted_total_area_m2", "leaf_area_m2", "lai"] {
            assert!(found[area].is_null(), "{name}: {area} without a rig");
        }
        // The first scan's extremes are a part of the whole recording's.
        let metres = |value: &Value| value.as_f64().expect("a range");
        assert!(metres(&found["ranges"]["max_m"]) >= metres(&first["max"]) / 1000.0, "{name}");
        let beams = found["ranges"]["returns"].as_u64().expect("a count")
            + found["ranges"]["misses"].as_u64().expect("a count");
        assert_eq!(
            Some(beams),
            found["scans"].as_u64().zip(first["count"].as_u64()).map(|(s, n)| s * n),
            "{name}"
        );
    }
}
