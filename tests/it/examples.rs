//! The driver's examples, run against scanners and a recording.
#![allow(clippy::expect_used, clippy::print_stdout, reason = "a test fails by panicking, an example prints")]

#[path = "../../driver/examples/estimate_row.rs"]
#[expect(dead_code, reason = "main is the example's")]
mod estimate_row;
#[path = "../../driver/examples/print_scans.rs"]
#[expect(dead_code, reason = "main is the example's")]
mod print_scans;
#[path = "../../driver/examples/read_recording.rs"]
#[expect(dead_code, reason = "main is the example's")]
mod read_recording;

use rowscan_driver::Source;

use crate::common::binary::{Emulator, run, text};

fn source(address: &str) -> Source {
    address.parse().expect("a source")
}

#[tokio::test]
async fn print_scans_subscribes_over_tcp() {
    let scanner = Emulator::start(&["post", "--time-scale", "max"]);
    let mut lines = Vec::new();
    print_scans::for_scans(&source(&scanner.url()), 5, |line| lines.push(line)).await.expect("scans");
    assert_eq!(lines.len(), 5);
    assert!(lines.iter().all(|line| line.contains("541 beams from -45.0° by 0.5000°")), "{lines:?}");
}

#[tokio::test]
async fn print_scans_reads_a_serial_lms2xx() {
    let folder = tempfile::tempdir().expect("a folder");
    let port = folder.path().join("scanner");
    let _scanner = Emulator::on_a_line(
        "emulate",
        &["post", "--model", "lms291", "--pty", text(&port), "--time-scale", "max"],
    );
    let mut lines = Vec::new();
    let serial = source(&format!("serial:{}", port.display()));
    print_scans::for_scans(&serial, 3, |line| lines.push(line)).await.expect("scans");
    assert_eq!(lines.len(), 3);
    assert!(lines.iter().all(|line| line.contains("beams from 0.0°")), "{lines:?}");
}

#[tokio::test]
async fn estimate_row_finds_the_trees_of_the_row() {
    let scanner = Emulator::start(&["spindle", "--time-scale", "max"]);
    let estimate = estimate_row::estimate(&source(&scanner.url()), 900).await.expect("an estimate");
    assert_eq!(estimate.scans, 900);
    let seen = estimate.trees.iter().filter(|tree| tree.impacted_total_area_m2 > 1.0).count();
    assert!((11..=13).contains(&seen), "the row has 12 trees: {seen}");
}

#[tokio::test]
async fn read_recording_gives_every_scan() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let scanner = Emulator::start(&["post", "--time-scale", "max"]);
    let recorded = run(&["record", &scanner.url(), "-o", text(&path), "--scans", "20"]);
    assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
    let ranges_m = read_recording::ranges(&path).await.expect("scans");
    assert!(ranges_m.len() >= 20 && ranges_m.iter().all(|ranges_m| ranges_m.len() == 541));
    let bytes = read_recording::bytes_of_streams(&path).expect("bytes");
    assert!(bytes.len() == 1 && bytes[0] > 20 * 541 * 2, "{bytes:?}");
}
