//! Left and right scanner of one tractor in one process.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

mod common;

use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};

use common::binary::{finish, interrupt, rowscan, run};
use serde_json::Value;

const SCENE: &str = r#"
version = 1
[orchard]
preset = "spindle"
trees = 3
rows = 2
[orchard.tree]
iterations = 6
[drive]
alley = 1
[[rig.scanner]]
model = "lms111"
distance_m = 2.0
row = "right"
[[rig.scanner]]
model = "tim561"
distance_m = 2.0
row = "left"
"#;

/// Ends the emulator however the test ends.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn each_scanner_has_its_own_port_and_sees_its_own_row() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("two.toml");
    std::fs::write(&scene, SCENE).unwrap();
    let scene = scene.to_str().unwrap();
    let mut emulate = rowscan();
    emulate.args(["emulate", scene, "--scanner", "0", "--scanner", "1", "--format", "jsonl"]);
    let recording = folder.path().join("both.mcap");
    let recording = recording.to_str().unwrap();
    emulate.args(["--tcp", "127.0.0.1:0", "--tcp", "127.0.0.1:0", "--record", recording]);
    let child = emulate.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the binary runs");
    let mut running = Running(child);
    let mut lines = BufReader::new(running.0.stdout.take().unwrap()).lines();
    let mut place = |scanner: u64| {
        let stream = format!("scanner{scanner}");
        let line: Value = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
        assert_eq!(
            (&line["event"], line["stream"].as_str()),
            (&Value::from("listening"), Some(stream.as_str()))
        );
        line["address"].as_str().unwrap().to_owned()
    };
    let places = [(0, place(0)), (1, place(1))];
    let estimates = places.map(|(scanner, place)| {
        let (source, scanner) = (format!("tcp://{place}"), scanner.to_string());
        let mut estimate = rowscan();
        estimate.args([
            "estimate",
            &source,
            "--rig",
            scene,
            "--scanner",
            &scanner,
            "--scans",
            "60",
            "--format",
            "json",
        ]);
        estimate.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary runs")
    });
    let [right, left] = estimates.map(|child| {
        let ended = finish(child);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        serde_json::from_str::<Value>(&ended.stdout).unwrap()
    });
    // An LMS111 turns fifty times a second, a TiM561 fifteen times: the same tractor goes farther between its lines.
    for (estimate, hertz) in [(&right, 50.0), (&left, 15.0)] {
        assert_eq!(estimate["scans"], 60);
        let advance_m = estimate["advance_m"].as_f64().unwrap();
        // A host that is held up misses some.
        let turns = 59.0 + estimate["scans_lost"].as_f64().unwrap();
        assert!((advance_m - turns / hertz).abs() < 2.5 / hertz, "{advance_m} m at {hertz} Hz");
        assert!(estimate["impacted_total_area_m2"].as_f64().unwrap() > 0.05, "{estimate}");
    }
    interrupt(&running.0);
    running.0.wait().unwrap();
    for (stream, points) in [("scanner0", 541), ("scanner1", 811)] {
        let ended = run(&["estimate", &format!("{recording}#{stream}"), "--format", "json"]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let recorded: Value = serde_json::from_str(&ended.stdout).unwrap();
        assert_eq!(recorded["points_per_scan"], points, "{stream}");
    }
}

#[test]
fn what_several_scanners_cannot_share_is_refused() {
    let two = ["emulate", "spindle", "--scanner", "0", "--scanner", "1"];
    for (flags, remedy) in [
        (&["--time-scale", "max"][..], "--time-scale 1"),
        (&["--tcp", "127.0.0.1:0"], "one --tcp for each of the 2 scanners"),
        (&["--state", "settings.txt"], "give one --scanner"),
        (&["--tcp", "127.0.0.1:0", "--tcp", "127.0.0.1:0"], "there is no scanner number 1"),
    ] {
        let ended = run(&[&two, flags].concat());
        assert_eq!(ended.code, Some(2), "{flags:?}");
        assert!(ended.stderr.contains(remedy), "{flags:?}: {}", ended.stderr);
    }
}
