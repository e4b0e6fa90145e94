//! Recorded telegrams of real devices go through the same driver and pipeline. The recordings are read where they lie.

use crate::common;

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

/// The telegram counters of a recording's scans, by the recording's own index and the layout of the telegram listing: 10 bytes into
/// the body, which follows 8 bytes of frame header and `sSN LMDscandata `.
fn telegram_counters(folder: &Path, name: &str, about: &Value) -> Vec<u16> {
    let bytes = std::fs::read(folder.join(format!("{name}.d2h.bin"))).expect("recorded");
    let index = about["index"].as_array().expect("an index");
    let frames = index.iter().filter(|entry| entry[1] == "d2h").map(|entry| {
        let at = |n: usize| entry[n].as_u64().expect("a place") as usize;
        &bytes[at(2)..at(2) + at(3)]
    });
    frames
        .filter(|frame| frame[8..].starts_with(b"sSN LMDscandata "))
        .map(|frame| u16::from_be_bytes([frame[34], frame[35]]))
        .collect()
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
        let counters = telegram_counters(&folder, name, &about);
        let repeated = counters.windows(2).filter(|pair| pair[0] == pair[1]).count();
        let lost: usize = counters
            .windows(2)
            .map(|pair| usize::from(pair[1].wrapping_sub(pair[0])).saturating_sub(1))
            .sum();
        assert_eq!(found["scans_repeated"], repeated, "{name}");
        assert_eq!(found["scans_lost"], lost, "{name}");
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
        let points = first["count"].as_u64().expect("stated");
        assert_eq!(beams, (counters.len() - repeated) as u64 * points, "{name}");
    }
}
