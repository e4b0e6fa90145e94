//! A classic LMS2xx from the line to the recording and back. Alone in its file: its client's reply time-outs are real time, and tests of one
//! file run side by side.
#![cfg(target_os = "linux")]
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

mod common;

use std::time::Duration;

use common::binary::{Emulator, assert_says, interrupt, listening, refused, run};
use common::recorded::{estimate, folder};
use serde_json::Value;

#[test]
fn an_lms2xx_is_recorded_replayed_exported_and_estimated_alike() {
    let (_folder, file) = folder();
    let (rig, recorded, link) = (file("row.toml"), file("run.mcap"), file("lms"));
    let at_device = file("device.mcap");
    let args = [&rig, "--model", "lms291", "--pty", &link, "--time-scale", "max", "--record", &at_device];
    let (child, _) = listening("emulate", &args, 1);
    let emulator = Emulator { child, address: String::new() };
    let scans = ["--model", "lms291", "--scans", "25"];
    let source = format!("serial:{link}");
    let live = estimate(&source, &rig, &[&scans[..], &["--record", &recorded]].concat());
    let found: Value = serde_json::from_str(&live).expect("json");
    assert_eq!((&found["scans"], &found["scans_lost"]), (&25.into(), &0.into()));
    assert!(found["impacted_total_area_m2"].as_f64().expect("known") > 0.0);
    interrupt(&emulator.child);
    std::thread::sleep(Duration::from_millis(500));
    drop(emulator);

    assert_eq!(estimate(&recorded, &rig, &scans), live, "the host's recording");
    assert_eq!(estimate(&at_device, &rig, &scans), live, "the device's recording");
    let again = file("lms-again");
    let (child, endpoints) = listening("replay", &[&recorded, "--pty", &again, "--time-scale", "max"], 1);
    assert_eq!(endpoints[0]["endpoint"], "pty");
    let replay = Emulator { child, address: String::new() };
    assert_eq!(estimate(&format!("serial:{again}"), &rig, &scans), live, "the replay");
    drop(replay);

    let ranges = file("ranges.csv");
    let ended = run(&["export", &recorded, "--to", "csv", "--what", "scans", "-o", &ranges]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let text = std::fs::read_to_string(&ranges).expect("written");
    assert!(text.lines().count() >= 25 + 2, "{} lines", text.lines().count());
    let info = run(&["record", "--info", &recorded, "--format", "json"]);
    let info: Value = serde_json::from_str(&info.stdout).expect("json");
    assert_eq!(info["streams"][0]["kind"], "lms2xx");
    assert!(info["streams"][0]["scans"].as_u64().expect("counted") >= 25);

    // One line, and nobody who speaks another language.
    assert_says(
        &refused(&["replay", &recorded, "--tcp", "127.0.0.1:0", "--pty", &file("two")]),
        &["one serial line"],
    );
    assert_says(
        &refused(&["replay", &recorded, "--pty", &file("no"), "--model", "lms111"]),
        &["is lms2xx", "LMS111"],
    );
}
