//! Recordings from standard input.

use crate::common;

use std::io::Write;
use std::process::Stdio;

use common::binary::{Ended, finish, rowscan, text};

/// A second of scans.
fn ranges() -> String {
    let beams = 181;
    let names: String = (0..beams).map(|beam| format!(",range_{beam}")).collect();
    let scan = |n: u64| format!("{},{n},{},0{}\n", n as f64 * 0.02, n * 20_000, ",2000".repeat(beams));
    let head = "# rowscan ranges 1; model lms111; frequency_hz 50; start_deg 0; step_deg 0.5; unit mm\n";
    let scans: String = (1..=50).map(scan).collect();
    format!("{head}received_s,telegram_counter,scan_time_us,status{names}\n{scans}")
}

fn fed(args: &[&str]) -> Ended {
    let mut child = rowscan()
        .args(args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    // Who refuses to read it is gone before all of it is written.
    let _ = child.stdin.take().expect("piped").write_all(ranges().as_bytes());
    finish(child)
}

#[test]
fn every_command_that_reads_a_recording_once_reads_standard_input() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = folder.path().join("new.mcap");
    for (args, expected) in [
        (&["estimate", "-"][..], "points a scan         181"),
        (&["export", "-", "--to", "csv", "-o", "-"], "x_m,y_m"),
        (&["record", "--info", "-"], "50.000"),
        (&["decode", "-"], "LMDscandata"),
        (&["record", "-", "-o", text(&output)], ""),
    ] {
        let ended = fed(args);
        assert_eq!(ended.code, Some(0), "{args:?}: {}", ended.stderr);
        assert!(ended.stdout.contains(expected), "{args:?}: {}", ended.stdout);
    }
    assert!(output.is_file());
}

#[test]
fn what_needs_standard_input_twice_says_what_to_do() {
    for args in [&["estimate", "-", "-"][..], &["replay", "-"]] {
        let ended = fed(args);
        assert_eq!(ended.code, Some(2), "{args:?}: {}", ended.stderr);
        assert!(ended.stderr.contains("write it to a file first"), "{args:?}: {}", ended.stderr);
    }
}
