//! Captures with several connections to one scanner: every command sees the same streams, and says what it leaves out.

use crate::common;

use common::binary::{Emulator, assert_says, refused, run};
use common::captured::{DEVICE, Talk};
use common::recorded::folder;
use serde_json::Value;

fn info(source: &str) -> Value {
    let told = run(&["record", "--info", source, "--format", "json"]);
    assert_eq!(told.code, Some(0), "{}", told.stderr);
    serde_json::from_str(&told.stdout).expect("json")
}

/// Scans and what was said beside them.
fn estimated(source: &str) -> (Value, String) {
    let told = run(&["estimate", source, "--format", "json"]);
    assert_eq!(told.code, Some(0), "{}", told.stderr);
    (serde_json::from_str(&told.stdout).expect("json"), told.stderr)
}

fn exported(source: &str) -> (usize, String) {
    let told = run(&["export", source, "--to", "csv", "--what", "scans", "-o", "-"]);
    assert_eq!(told.code, Some(0), "{}", told.stderr);
    // A title and a header stand before the scans.
    (told.stdout.lines().count() - 2, told.stderr)
}

/// A client gets as many scans of a replay, and no more are sent.
fn assert_replayed(file: &str, more: &[&str], scans: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let sent = folder.path().join("sent.mcap");
    let sent = sent.to_str().expect("UTF-8");
    let args = [&[file, "--model", "lms111", "--time-scale", "max", "--record", sent], more].concat();
    let mut replay = Emulator::command("replay", &args);
    let told = run(&["estimate", &replay.url(), "--scans", &scans.to_string(), "--format", "json"]);
    assert_eq!(told.code, Some(0), "{}", told.stderr);
    // It ends by itself once the last scan is out.
    assert!(replay.child.wait().expect("it ends").success());
    assert_eq!(info(sent)["streams"][0]["scans"], scans);
}

#[test]
fn a_reconnect_is_one_stream_and_each_connection_has_a_name() {
    let (_folder, file) = folder();
    let path = file("reconnect.pcap");
    let mut talk = Talk::new();
    talk.connect(50_000, 1);
    (1..=66).for_each(|number| talk.scan(50_000, number));
    // Away for 20 scans.
    talk.connect(50_001, 87);
    (87..=219).for_each(|number| talk.scan(50_001, number));
    talk.write(&path);

    let whole = info(&path);
    let streams = whole["streams"].as_array().expect("listed");
    assert_eq!((streams.len(), &streams[0]["stream"]), (1, &DEVICE.into()));
    assert_eq!((&streams[0]["scans"], &streams[0]["scans_lost"]), (&199.into(), &20.into()));
    let names = [format!("{DEVICE}/1.1"), format!("{DEVICE}/1.2")];
    assert_eq!(streams[0]["connections"], serde_json::json!(names));
    let (found, said) = estimated(&path);
    assert_eq!((&found["scans"], &found["scans_lost"]), (&199.into(), &20.into()));
    assert!(!said.contains("left out"), "{said}");
    assert_eq!(exported(&path).0, 199);
    assert_replayed(&path, &[], 199);

    for (name, scans) in names.iter().zip([66, 133]) {
        let one = format!("{path}#{name}");
        assert_eq!(info(&one)["streams"][0]["scans"], scans);
        assert_eq!(estimated(&one).0["scans"], scans);
        assert_eq!(exported(&one).0, scans);
        assert_replayed(&path, &["--stream", name], scans);
        let copy = file(&format!("{scans}.mcap"));
        let ended = run(&["record", &one, "-o", &copy]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        assert_eq!(estimated(&copy).0["scans"], scans);
    }
    for args in [&["estimate"][..], &["record", "--info"]] {
        let message = refused(&[args, &[&format!("{path}#{DEVICE}/1.3")]].concat());
        assert_says(&message, &["no stream", "/1.3", DEVICE]);
    }
}

#[test]
fn two_clients_at_once_are_two_streams_and_the_one_left_out_is_told() {
    let (_folder, file) = folder();
    let path = file("two.pcap");
    let mut talk = Talk::new();
    talk.connect(50_000, 1);
    talk.connect(50_001, 1);
    for number in 1..=200 {
        talk.scan(50_000, number);
        talk.scan(50_001, number);
    }
    talk.write(&path);
    let second = format!("{DEVICE}/2");

    let told = |source: &str| {
        let told = info(source);
        let streams = told["streams"].as_array().expect("listed").clone();
        let keys = ["stream", "scans", "scans_lost", "telegrams_bad", "packets_lost"];
        streams.iter().map(|stream| keys.map(|key| stream[key].to_string()).join(" ")).collect::<Vec<_>>()
    };
    let expected = [format!("\"{DEVICE}\" 200 0 0 0"), format!("\"{second}\" 200 0 0 0")];
    assert_eq!(told(&path), expected);
    let copy = file("two.mcap");
    let ended = run(&["record", &path, "-o", &copy]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_eq!(told(&copy), expected);
    for source in [&path, &copy] {
        let (found, said) = estimated(source);
        assert_eq!((&found["scans"], &found["telegrams_bad"]), (&200.into(), &0.into()));
        assert_says(&said, &["left out", &second, "#STREAM"]);
        let (scans, said) = exported(source);
        assert_eq!(scans, 200);
        assert_says(&said, &["left out", &second]);
        assert_eq!(estimated(&format!("{source}#{second}")).0["scans"], 200);
    }
    assert_replayed(&path, &["--stream", &second], 200);
}

#[test]
fn repeats_restarts_and_outages_are_counted_alike_by_all() {
    let (_folder, file) = folder();
    let path = file("doubled.pcap");
    let mut talk = Talk::new();
    talk.connect(50_000, 1000);
    // Every telegram twice; four are missing.
    for number in (1000..1100).filter(|number| !(1050..1054).contains(number)) {
        talk.scan(50_000, number);
        talk.scan(50_000, number);
    }
    // Switched off, and on again eight seconds later.
    (0..100).for_each(|number| talk.scan_at(30_000 + u64::from(number) * 20, 50_000, number));
    talk.write(&path);
    let stream = &info(&path)["streams"][0];
    let (found, said) = estimated(&path);
    for (key, expected) in [("scans", 292), ("scans_repeated", 96)] {
        assert_eq!((&stream[key], &found[key]), (&expected.into(), &expected.into()), "{key}");
    }
    // Four before the restart, and nobody knows how many at it.
    assert_eq!((&stream["scans_lost"], &found["scans_lost"]), (&Value::Null, &Value::Null));
    assert_eq!((&stream["restarts"], &stream["outages"]), (&1.into(), &1.into()));
    assert!(found["warnings"].to_string().contains("restarts"), "{found} {said}");
    let hertz = |value: &Value| value.as_f64().expect("measured");
    assert_eq!(hertz(&stream["scan_rate_device_hz"]), hertz(&found["scan_frequency_hz"]));
    assert!((hertz(&found["scan_frequency_hz"]) - 50.0).abs() < 1e-9);
}

/// Every reader tells what a capture lacks; whoever passes on what it holds ends with a finding, for a part looks like a whole.
#[test]
fn what_a_capture_lacks_is_told() {
    let (_folder, file) = folder();
    let mut talk = Talk::new();
    talk.connect(50_000, 1);
    (1..=100).for_each(|number| talk.scan(50_000, number));
    let path = file("part.pcap");
    for (case, (lost, most, told)) in [
        (None, u32::MAX, None),
        (Some(50), u32::MAX, Some("bytes are missing from the capture, in 1 place")),
        (None, 150, Some("packets were captured in part: capture whole packets")),
    ]
    .into_iter()
    .enumerate()
    {
        talk.write_part(&path, lost, most);
        let copy = file(&format!("copy{case}.mcap"));
        let part = i32::from(told.is_some());
        for (args, code) in [
            (&["record", "--info", &path][..], part),
            (&["record", &path, "-o", &copy], part),
            (&["export", &path, "--to", "csv", "--what", "scans", "-o", "-"], part),
            // Of packets that are all cut no scan is left.
            (&["estimate", &path], i32::from(most < u32::MAX)),
        ] {
            let ended = run(args);
            let says = told.is_none_or(|told| ended.stderr.contains(told));
            assert!(says && ended.code == Some(code), "{args:?}: {:?} {}", ended.code, ended.stderr);
            let says = ["missing from", "captured in part"].iter().any(|word| ended.stderr.contains(word));
            assert!(told.is_some() || !says, "{args:?}: {}", ended.stderr);
        }
        assert_eq!(run(&["decode", &path]).code, Some(part));
    }
}
