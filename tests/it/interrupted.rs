//! SIGINT ends every command in order: exit 0, and the result so far where there is one.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

use crate::common;

use std::process::Stdio;
use std::time::Duration;

use common::binary::{Emulator, Ended, finish, interrupt, rowscan, run};

fn interrupted(args: &[&str], after: Duration) -> Ended {
    let child =
        rowscan().args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary runs");
    std::thread::sleep(after);
    interrupt(&child);
    finish(child)
}

#[test]
fn every_command_ends_with_zero() {
    for args in [
        &["emulate", "--tcp", "127.0.0.1:0"][..],
        &["demo", "--time-scale", "1"],
        &["orchard", "grow", "mature"],
        &["orchard", "truth", "mature"],
        &["study", "accuracy", "--seeds", "1..2000"],
        &["study", "calibration", "--seeds", "1..2000"],
    ] {
        let ended = interrupted(args, Duration::from_millis(700));
        assert_eq!(ended.code, Some(0), "{args:?}: {}", ended.stderr);
    }
}

#[test]
fn an_interrupted_estimate_prints_what_it_has() {
    let emulator = Emulator::start(&["--time-scale", "1"]);
    let ended = interrupted(
        &["estimate", &emulator.url(), "--rig", "spindle", "--format", "json"],
        Duration::from_secs(3),
    );
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let estimate: serde_json::Value = serde_json::from_str(&ended.stdout).expect("json");
    let scans = estimate["scans"].as_u64().expect("a count");
    assert!(scans > 10, "{scans} scans in about two seconds");
    assert!(estimate["advance_m"].as_f64().expect("the rig is known") > 0.1);
}

#[test]
fn a_reader_that_has_read_enough_is_no_failure() {
    let mut child = rowscan()
        .args(["models", "--format", "json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    drop(child.stdout.take());
    assert_eq!(finish(child).code, Some(0));
    assert_eq!(run(&["models"]).code, Some(0));
}
