//! Signals end every command in order: exit 0 with the result so far where there is one, else 128 and the signal's number.

use crate::common;

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use common::binary::{Emulator, Ended, finish, rowscan, run};
use rowscan::feature::Feature;
use rowscan_protocol::frame::{Dialect, encode};

fn interrupted(args: &[&str], after: Duration) -> Ended {
    signalled(args, "INT", after)
}

fn signalled(args: &[&str], signal: &str, after: Duration) -> Ended {
    let mut child = spawn(args);
    // From its first word on.
    first_line(&mut child);
    std::thread::sleep(after);
    send(&child, signal);
    finish(child)
}

fn spawn(args: &[&str]) -> Child {
    rowscan().args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary runs")
}

/// Waits until it says something on standard error.
fn first_line(child: &mut Child) {
    let mut line = Vec::new();
    let stderr = child.stderr.as_mut().expect("piped");
    let mut byte = [0];
    while line.last() != Some(&b'\n') && stderr.read(&mut byte).expect("read") > 0 {
        line.extend(byte);
    }
}

fn send(child: &Child, signal: &str) {
    let sent = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
}

#[test]
fn commands_that_serve_end_with_zero() {
    let args = ["emulate", "--tcp", "127.0.0.1:0"];
    let ended = interrupted(&args, Duration::ZERO);
    assert_eq!(ended.code, Some(0), "{args:?}: {}", ended.stderr);
}

#[test]
fn a_demo_that_has_not_passed_its_row_tells_no_error_of_it() {
    let ended = interrupted(&["demo", "--time-scale", "1", "--format", "json"], Duration::from_secs(4));
    assert_eq!(ended.code, Some(130), "{}", ended.stderr);
    assert!(ended.stderr.contains("no error of the row is known"), "{}", ended.stderr);
    let told: serde_json::Value = serde_json::from_str(&ended.stdout).expect("what it has, as JSON");
    assert_eq!(told["row_passed"], false, "{told}");
    assert!(told["leaf_area_error"].is_null() && told["leaf_area_regression_error"].is_null(), "{told}");
    assert!(told["truth"]["leaf_area_m2"].as_f64() > Some(0.0), "{told}");
}

#[test]
fn commands_without_their_result_end_with_the_signal() {
    let folder = tempfile::tempdir().expect("a folder");
    let (output, scene) = (folder.path().join("shard.json"), folder.path().join("long.toml"));
    let (output, scene) = (output.to_str().expect("UTF-8"), scene.to_str().expect("UTF-8"));
    // Takes a minute to grow.
    std::fs::write(scene, "version = 1\n[orchard]\npreset = \"mature\"\ntrees = 2000\n").expect("written");
    for (signal, code, args) in [
        ("INT", 130, &["orchard", "grow", scene][..]),
        ("TERM", 143, &["orchard", "truth", scene]),
        ("HUP", 129, &["orchard", "statistics", "mature", "--seeds", "1..2000"]),
        ("INT", 130, &["study", "accuracy", "--seeds", "1..2000"]),
        ("TERM", 143, &["study", "calibration", "--seeds", "1..2000"]),
        ("INT", 130, &["study", "areas", "-o", output]),
    ] {
        // They say nothing until they are done.
        let child = spawn(args);
        std::thread::sleep(Duration::from_millis(700));
        send(&child, signal);
        let ended = finish(child);
        // A program that a loaded machine has not yet started is ended by the system, which a shell tells by the same number.
        assert_eq!(ended.code.unwrap_or(code), code, "{args:?}: {}", ended.stderr);
    }
    assert!(!std::path::Path::new(output).exists());
}

#[test]
fn a_hang_up_closes_a_recording() {
    let emulator = Emulator::start(&["--time-scale", "1"]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let args = ["record", &emulator.url(), "-o", path.to_str().expect("UTF-8")];
    let ended = signalled(&args, "HUP", Duration::from_secs(2));
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let mut recording = rowscan_recording::Recording::open(&path).expect("it opens");
    let report = rowscan_recording::account(&mut recording).expect("it reads").remove(0);
    assert!(recording.torn().is_none() && report.scans > 10, "{report:?}");
}

#[test]
fn a_recording_in_which_nothing_came_is_not_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    // Nobody connects.
    let args = ["emulate", "--tcp", "127.0.0.1:0", "--record", path.to_str().expect("UTF-8")];
    let ended = signalled(&args, "INT", Duration::from_secs(2));
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert!(ended.stderr.contains("nothing was recorded") && !path.exists(), "{}", ended.stderr);
}

#[test]
fn an_interrupted_estimate_prints_what_it_has() {
    let emulator = Emulator::start(&["--time-scale", "1"]);
    let ended = interrupted(
        &["estimate", &emulator.url(), "--rig", "spindle", "--format", "json"],
        // Leaves are met after two seconds, on a machine that has nothing else to do.
        Duration::from_secs(6),
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

#[test]
fn a_closed_pipe_is_the_same_for_every_command_and_format() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scans.bin");
    std::fs::write(&file, scans(400)).expect("written");
    let file = file.to_str().expect("UTF-8");
    let mut lines = vec![
        vec!["decode", file],
        vec!["decode", file, "--format", "jsonl"],
        vec!["record", file, "-o", "-"],
        vec!["orchard", "parameters", "spindle"],
        vec!["orchard", "truth", "post", "--format", "csv"],
        vec!["orchard", "export", "post", "--svg", "-"],
        vec!["bus", "dbc"],
        vec!["faults"],
        vec!["schema", "scene"],
        vec!["rig", "new"],
        vec!["scene", "show", "post"],
    ];
    let mut formats = vec!["csv", "npy", "ply"];
    if Feature::Tables.is_built() {
        formats.extend(["las", "parquet"]);
    }
    for format in formats {
        lines.push(vec!["export", file, "--what", "points", "--to", format, "-o", "-"]);
    }
    for line in lines {
        let mut child = rowscan()
            .args(&line)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary runs");
        drop(child.stdout.take());
        let ended = finish(child);
        assert_eq!(ended.code, Some(0), "{line:?}: {}", ended.stderr);
        assert!(!ended.stderr.contains("Broken pipe"), "{line:?}: {}", ended.stderr);
    }
}

/// So many scans of a few beams.
fn scans(count: u16) -> Vec<u8> {
    let mut bytes = Vec::new();
    for counter in 0..count {
        let scan = format!(
            "sSN LMDscandata 1 1 16F4C7A 0 0 {counter:X} {counter:X} {0:X} {0:X} 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0",
            u32::from(counter) * 20_000,
        );
        encode(Dialect::A, scan.as_bytes(), &mut bytes);
    }
    bytes
}

/// Which readers leave before a word is written: of standard output, of standard error.
const LEAVING: [(bool, bool); 3] = [(true, false), (false, true), (true, true)];

fn left_alone(args: &[&str], (out, err): (bool, bool)) -> Option<i32> {
    let mut child = spawn(args);
    if out {
        drop(child.stdout.take());
    }
    if err {
        drop(child.stderr.take());
    }
    finish(child).code
}

#[test]
fn no_command_panics_because_a_reader_left() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    // Its verdict is its exit code, whoever reads the words.
    let failing = at("failing.toml");
    let scenario = "version = 1\nscene = \"post\"\nend = { s = 0.5 }\n[[device]]\nid = \"left\"\nmodel = \"lms111\"\n\
         [[run]]\nid = \"sut\"\ncommand = [\"false\"]\n[[expect]]\nwhat = \"exit_code\"\n";
    std::fs::write(&failing, scenario).expect("written");
    let (broken, missing) = (at("broken.toml"), at("missing.toml"));
    std::fs::write(&broken, "version = 1\nthere_is_no_such_key = 1\n").expect("written");
    let heard = |args: &[&str]| run(args).code.expect("a code");
    assert_ne!(heard(&["check", &failing]), 0);
    for args in [
        vec!["models"],
        vec!["no-such-command"],
        vec!["check", &failing],
        vec!["check", &failing, "--format", "tap"],
        vec!["check", &broken],
        vec!["score", &missing],
        vec!["orchard", "truth", &missing],
        vec!["bus", "dbc"],
        vec!["demo", "--spray", "--format", "json"],
    ] {
        let code = heard(&args);
        for leaving in LEAVING {
            let found = left_alone(&args, leaving);
            assert_eq!(found, Some(code), "{args:?}: stdout and stderr closed: {leaving:?}");
        }
    }
}
