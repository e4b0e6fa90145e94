//! An export takes as much memory for three times the scans as for a third of them.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::io::Write;
use std::path::Path;

use allocation_counter::measure;
use rowscan::cli::{Outcome, run};
use rowscan::feature::Feature;
use rowscan_protocol::device::scan_event;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::telegram::LmdScandata;
use rowscan_protocol::telegram::lmd_scandata::Channel;
use rowscan_protocol::telegram::wire::FixedText;

/// Whatever the length of the recording, bytes.
const BOUND: u64 = 200 * 1024 * 1024;
/// Scans of the short recording: its points fill one row group of Parquet and begin another.
const SHORT: u32 = 1200;
/// The long one has so many times as many. Memory that grows with them would be three times as much, and a quarter more is too much.
const TIMES: u32 = 3;

/// Telegrams of an LMS111 that sees something with every beam, one after the other, without times.
fn write_recording(path: &Path, scans: u32) {
    let channel = Channel {
        name: FixedText(*b"DIST1"),
        scale: 1.0,
        start_angle: -450_000,
        step: 5000,
        values: (0..541).map(|beam| 1000 + beam).collect(),
        ..Channel::default()
    };
    let mut scan = LmdScandata {
        version: 1,
        device_number: 1,
        scan_frequency: 5000,
        channels16: vec![channel],
        ..LmdScandata::default()
    };
    let mut file = std::io::BufWriter::new(std::fs::File::create(path).expect("created"));
    let mut frame = Vec::new();
    for number in 0..scans {
        scan.telegram_counter = number as u16;
        scan.scan_counter = number as u16;
        scan.scan_time_us = number * 20_000;
        scan.transmit_time_us = scan.scan_time_us + 20_000;
        frame.clear();
        scan_event(Dialect::B, &scan, &mut frame);
        file.write_all(&frame).expect("written");
    }
    file.flush().expect("written");
}

/// The most memory that an export holds at a time, bytes.
fn peak(recording: &Path, more: &[&str]) -> u64 {
    let args = ["rowscan", "export", recording.to_str().expect("UTF-8"), "-o", "/dev/null"];
    let mut ended = None;
    let measured = measure(|| ended = Some(run(args.iter().chain(more))));
    assert!(matches!(ended, Some(Ok(Outcome::Done))), "{more:?}: {ended:?}");
    measured.bytes_max
}

#[test]
fn memory_does_not_grow_with_the_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let (short, long) = (folder.path().join("short.bin"), folder.path().join("long.bin"));
    write_recording(&short, SHORT);
    write_recording(&long, TIMES * SHORT);
    for more in [
        &["--to", "csv"][..],
        &["--to", "csv", "--what", "scans"],
        &["--to", "npy"],
        &["--to", "npy", "--what", "scans"],
        &["--to", "ply"],
        &["--to", "las"],
        &["--to", "parquet"],
    ]
    .into_iter()
    .filter(|more| Feature::Tables.is_built() || !["las", "parquet"].contains(&more[1]))
    {
        let (of_short, of_long) = (peak(&short, more), peak(&long, more));
        println!("{more:?}: {of_short} bytes of {SHORT} scans, {of_long} of {TIMES} times as many");
        assert!(of_long < BOUND, "{more:?}: {of_long} bytes");
        assert!(
            of_long < of_short + of_short / 4 + 1024 * 1024,
            "{more:?}: {of_short} bytes became {of_long}"
        );
    }
    // A row group of scans is longer than this recording.
    assert!(!Feature::Tables.is_built() || peak(&long, &["--to", "parquet", "--what", "scans"]) < BOUND);
}
