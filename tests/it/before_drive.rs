//! What a scanner sees before a run's drive begins, it sees of a tractor that stands: no recording of it is row driven past.

use crate::common;

use std::fs;
use std::io::Cursor;
use std::path::Path;

use common::binary::{Telling, run, text};
use common::replayed::Packets;
use common::talk::Talk;
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_recording::{About, Decoded, Drive, McapWriter, StreamKind};
use serde_json::Value;

const PACKET_NS: u64 = 20_000_000;

/// Writes packets, the first at 0, and at the end when the drive began.
fn keep(path: &Path, packets: &Packets, (at_first, at_end): (Option<Drive>, Option<Drive>)) {
    let about = About { drive: at_first, ..About::default() };
    let mut writer = McapWriter::new(Cursor::new(Vec::new()), &about, Decoded::default()).expect("begun");
    let stream = writer.add_stream("left", StreamKind::Cola).expect("added");
    for (at_ns, (_, from, bytes)) in (0..).step_by(PACKET_NS as usize).zip(packets) {
        writer.write(stream, *from, at_ns, 0, bytes).expect("written");
    }
    writer.describe(&About { drive: at_end, ..about }).expect("written");
    writer.finish().expect("finished");
    fs::write(path, writer.into_inner().into_inner()).expect("kept");
}

async fn counters(path: &Path) -> Vec<u16> {
    let source: Source = text(path).parse().expect("a file");
    let mut scanner = Scanner::open(&source, DriverConfig::default()).await.expect("it opens");
    let mut counters = Vec::new();
    while let Some(record) = scanner.next().await.expect("it reads") {
        counters.push(record.scan.telegram_counter);
    }
    counters
}

/// Wherever the drive begins, its scans are read, and no other one; all of a recording that knows of no drive, or was cut off before it is known.
#[tokio::test]
async fn scans_from_before_the_drive_are_left_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let said = Talk::with(model::by_name("lms111").expect("known"), Dialect::B).recorded(60);
    let before = said.len() - 60;
    keep(&path, &said, (None, None));
    let all = counters(&path).await;
    assert_eq!(all.len(), 60);
    for left_out in [0, 1, 7, 59] {
        let began = Drive::Began((before + left_out) as u64 * PACKET_NS);
        keep(&path, &said, (Some(Drive::Awaited), Some(began)));
        assert_eq!(counters(&path).await, all[left_out..], "{left_out} before");
        let copy = folder.path().join("copy.mcap");
        let ended = run(&["record", text(&path), "-o", text(&copy)]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        assert_eq!(counters(&copy).await, all[left_out..], "of a copy");
        fs::remove_file(copy).expect("removed");
    }
    keep(&path, &said, (Some(Drive::Awaited), Some(Drive::Awaited)));
    assert_eq!(counters(&path).await, all);
    let ended = run(&["estimate", text(&path), "--rig", "spindle"]);
    assert!(ended.stderr.contains("does not say when the drive began"), "{}", ended.stderr);
}

/// A replay begins where the drive did: who reads it counts the same way.
#[test]
fn a_replay_begins_with_the_drive() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let said = Talk::with(model::by_name("lms111").expect("known"), Dialect::B).recorded(60);
    let before = said.len() - 60;
    let began = Drive::Began((before + 20) as u64 * PACKET_NS);
    for (drive, scans) in [(None, 60), (Some(began), 40)] {
        keep(&path, &said, (drive, drive));
        let args = [text(&path), "--tcp", "127.0.0.1:0", "--time-scale", "max"];
        let mut replay = Telling::start("replay", &args);
        let url = format!("tcp://{}", replay.address());
        let taken = folder.path().join(format!("{scans}.mcap"));
        let ended = run(&["record", &url, "-o", text(&taken), "--scans", &scans.to_string()]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let told: Vec<Value> = replay.end();
        let played = told.iter().find_map(|line| line["scans_sent"].as_u64());
        assert_eq!(played, Some(scans), "{told:?}");
    }
}

const SCENE: &str = "version = 2
[orchard]
trees = 3
[orchard.tree]
iterations = 7
[[rig.scanner]]
model = \"lms111\"
offset_y_m = 0.7
";

const SCENARIO: &str = r#"version = 1
scene = "row.toml"
clock = { mode = "paced", scale = 2.0 }
end = { row_m = 3 }
device = [{ id = "left", model = "lms111" }]
run = [
  { id = "sut", command = ["{rowscan}", "estimate", "tcp://{left.tcp}", "--wait", "--rig", "{scenario}/row.toml"], ready = { line = "connected" } },
  { id = "slow", command = ["sh", "-c", "sleep 1; echo ready; sleep 60"], ready = { line = "ready" } },
]
expect = [{ what = "scans_lost", equals = 0 }]
"#;

/// A paced run has two seconds of its scanner's scans before the last child is ready.
#[test]
fn a_kept_run_is_estimated_over_what_was_driven() {
    let folder = tempfile::tempdir().expect("a folder");
    let (scene, scenario, kept) =
        (folder.path().join("row.toml"), folder.path().join("drive.toml"), folder.path().join("kept"));
    fs::write(&scene, SCENE).expect("written");
    fs::write(&scenario, SCENARIO).expect("written");
    let ended = run(&["check", text(&scenario), "--keep", text(&kept)]);
    let driven = kept.join("01-drive").read_dir().expect("kept").next().expect("a run").expect("a folder");
    let file = driven.path().join("run.mcap");
    let estimated = run(&["estimate", text(&file), "--rig", text(&scene), "--format", "json"]);
    let document: Value = serde_json::from_str(&estimated.stdout)
        .unwrap_or_else(|_| panic!("{}{}{}", ended.stdout, ended.stderr, estimated.stderr));
    let advance_m = document["advance_m"].as_f64().expect("known");
    assert!((2.9..3.2).contains(&advance_m), "{advance_m} m of 3");
    assert!(estimated.stderr.contains("scans from before the drive are left out"), "{}", estimated.stderr);
}
