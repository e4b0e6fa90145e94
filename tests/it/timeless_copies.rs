//! Bytes without times that are written to a file with times: those are the scanner's, and nobody knows the host's.

use std::fs;
use std::path::Path;

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_recording::Side;
use serde_json::Value;

use crate::common::binary::{run, text};
use crate::common::replayed::write;
use crate::common::talk::Talk;

/// What `record --info` tells of host times, and the first time of reception in an export.
fn told(path: &Path) -> ([bool; 3], String) {
    let info = run(&["record", "--info", text(path), "--format", "json"]);
    let info: Value = serde_json::from_str(&info.stdout).expect("JSON");
    let stream = &info["streams"][0];
    let known = ["begins_s", "duration_s", "longest_gap_s"].map(|key| !stream[key].is_null());
    let to = path.with_extension("csv");
    let exported = run(&["export", text(path), "--to", "csv", "--what", "scans", "-o", text(&to)]);
    let exported = fs::read_to_string(to).unwrap_or_else(|_| panic!("{}", exported.stderr));
    let mut lines = exported.lines().filter(|line| !line.starts_with('#'));
    let column = lines.next().expect("a head").split(',').position(|name| name == "received_s");
    let first = lines.next().expect("a scan").split(',').nth(column.expect("the column")).expect("a value");
    (known, first.to_owned())
}

#[test]
fn a_copy_of_bytes_without_times_knows_no_times_of_the_host() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name);
    let said = Talk::with(model::by_name("lms111").expect("known"), Dialect::B).recorded(40);
    let of_device = said.iter().filter(|(_, from, _)| *from == Side::Device);
    let bytes: Vec<u8> = of_device.flat_map(|(_, _, bytes)| bytes.iter().copied()).collect();
    fs::write(file("raw.bin"), bytes).expect("written");
    write(&file("timed.mcap"), &said);
    for (from, to) in [("raw.bin", "copy.mcap"), ("copy.mcap", "again.mcap"), ("timed.mcap", "still.mcap")] {
        let ended = run(&["record", text(&file(from)), "-o", text(&file(to))]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    }
    for name in ["raw.bin", "copy.mcap", "again.mcap"] {
        assert_eq!(told(&file(name)), ([false; 3], "NaN".to_owned()), "{name}");
    }
    let (known, first) = told(&file("still.mcap"));
    assert_eq!(known, [true; 3]);
    assert!(first.parse::<f64>().is_ok_and(f64::is_finite), "{first}");
}
