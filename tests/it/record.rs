//! `rowscan record` and its kin, through the whole binary: one truth however the bytes came, files that survive, and what is refused.

use crate::common;

use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use common::binary::{Emulator, assert_says, finish, refused, rowscan, run};
use common::captured::{Segments, Sent, pcap};
use common::recorded::{estimate, folder};
use rowscan_recording::{Recording, Side};
use serde_json::Value;

/// Both directions as an Ethernet capture, so many bytes a segment, some of them out of order and some twice.
fn capture(recording: &Path, to: &str) {
    let mut recording = Recording::open(recording).expect("it opens");
    let mut segments = Segments::new();
    let mut packets = Vec::new();
    while let Some(packet) = recording.next_packet().expect("it reads") {
        for bytes in packet.bytes.chunks(700) {
            let (at_ns, from_device) = (packet.at_ns.expect("timed"), packet.from == Some(Side::Device));
            let sent = Sent { at_ns, port: 50_000, from_device, bytes: bytes.to_vec() };
            packets.push((at_ns, segments.packet(&sent)));
        }
    }
    for i in (5..packets.len().saturating_sub(1)).step_by(7) {
        packets.swap(i, i + 1);
    }
    for i in (3..packets.len()).step_by(11) {
        packets.push(packets[i].clone());
    }
    std::fs::write(to, pcap(packets)).expect("written");
}

#[test]
fn the_estimate_is_the_same_live_recorded_captured_and_replayed() {
    let (_folder, file) = folder();
    let (rig, recorded, at_device) = (file("row.toml"), file("run.mcap"), file("device.mcap"));
    let scans = ["--scans", "120"];
    let emulator =
        Emulator::start(&[&rig, "--time-scale", "max", "--record", &at_device, "--decoded", "none"]);
    let live = estimate(&emulator.url(), &rig, &[&scans[..], &["--record", &recorded]].concat());
    let found: Value = serde_json::from_str(&live).expect("json");
    assert!(found["impacted_total_area_m2"].as_f64().expect("known") > 0.0);
    // Its file is whole once it has ended.
    emulator.end();

    // What came while the client said good-bye is recorded too.
    assert_eq!(estimate(&recorded, &rig, &scans), live, "the host's recording");
    assert_eq!(estimate(&at_device, &rig, &scans), live, "the device's recording");
    let captured = file("run.pcap");
    capture(Path::new(&recorded), &captured);
    assert_eq!(estimate(&captured, &rig, &scans), live, "the capture");
    let replayed = Emulator::command("replay", &[&recorded, "--time-scale", "max"]);
    assert_eq!(estimate(&replayed.url(), &rig, &scans), live, "the replay");
}

#[test]
fn killed_five_times_it_loses_no_more_than_the_unflushed_tail() {
    let (_folder, file) = folder();
    let emulator = Emulator::start(&[&file("row.toml")]);
    for round in 0..5 {
        let path = file(&format!("killed{round}.mcap"));
        let mut child = rowscan()
            .args(["record", &emulator.url(), "-o", &path])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("it runs");
        std::thread::sleep(Duration::from_millis(900 + 137 * round));
        child.kill().expect("killed");
        child.wait().expect("gone");
        let mut recording = Recording::open(Path::new(&path)).expect("it opens without help");
        let report = rowscan_recording::account(&mut recording).expect("it reads").remove(0);
        assert!(recording.torn().is_some(), "it was killed");
        assert!(report.scans > 5 && report.scans_lost == Some(0) && report.telegrams_bad == 0, "{report:?}");
        let repaired = run(&["record", "--repair", &path]);
        assert_eq!(repaired.code, Some(0), "{}", repaired.stderr);
        let info = run(&["record", "--info", &path, "--format", "json"]);
        let info: Value = serde_json::from_str(&info.stdout).expect("json");
        assert!(info["torn"].is_null());
        assert_eq!(info["streams"][0]["scans"], report.scans);
    }
}

#[test]
fn two_scanners_share_a_file_and_are_told_apart() {
    let (_folder, file) = folder();
    let (left, right) =
        (Emulator::start(&[&file("row.toml")]), Emulator::start(&[&file("row.toml"), "--model", "lms511"]));
    let path = file("both.mcap");
    let sources = [format!("left={}", left.url()), format!("right={}", right.url())];
    let ended = run(&["record", &sources[0], &sources[1], "-o", &path, "--scans", "10"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    for (stream, points) in [("left", 541), ("right", 1141)] {
        let ended = run(&["estimate", &format!("{path}#{stream}"), "--format", "json"]);
        let found: Value = serde_json::from_str(&ended.stdout).expect("json");
        assert_eq!(found["points_per_scan"], points, "{stream}");
        assert_eq!(found["scans_lost"], 0, "{stream}");
    }
    let wrong = run(&["estimate", &format!("{path}#middle")]);
    assert_eq!(wrong.code, Some(2));
    assert!(wrong.stderr.contains("no stream `middle`; it has left, right"), "{}", wrong.stderr);
}

#[test]
fn what_is_no_recording_is_refused_with_what_it_is() {
    let (_folder, file) = folder();
    let write = |name: &str, bytes: &[u8]| {
        let path = file(name);
        std::fs::write(&path, bytes).expect("written");
        path
    };
    let magic = write("magic.mcap", b"\x89MCAP0\r\n");
    for command in ["estimate", "decode", "replay"] {
        assert_says(&refused(&[command, &magic]), &["magic.mcap", "without a recorded stream"]);
        assert_says(&refused(&[command, &write("empty.mcap", b"")]), &["empty.mcap", "0 bytes"]);
        assert_says(&refused(&[command, &file("none.mcap")]), &["none.mcap", "No such file"]);
    }
    // A capture of HTTP.
    let mut http: Vec<u8> =
        [0xA1B2_C3D4_u32, 0x0002_0004, 0, 0, 65535, 101].iter().flat_map(|w| w.to_be_bytes()).collect();
    let mut packet =
        vec![0x45, 0, 0, 0, 0, 0, 0x40, 0, 64, 6, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2, 0, 80, 0x9C, 0x40];
    packet.extend([0, 0, 0, 1, 0, 0, 0, 0, 0x50, 0x18, 0, 0, 0, 0, 0, 0]);
    packet.extend(b"HTTP/1.1 200 OK\r\n\r\n");
    http.extend([0, 0, packet.len() as u32, packet.len() as u32].iter().flat_map(|w| w.to_be_bytes()));
    http.extend(packet);
    let http = write("http.pcap", &http);
    assert_says(&refused(&["estimate", &http]), &["http.pcap", "network capture", "no SICK telegram"]);
    assert_says(&refused(&["replay", &http]), &["http.pcap", "nothing to play", "10.0.0.1:80"]);
    assert_says(&refused(&["decode", &http]), &["http.pcap", "no telegram found"]);
    let can = write("bus.log", b"(1700000000.000001) can0 18FEF100#0102\n");
    assert_says(&refused(&["estimate", &can]), &["candump log", "no SICK telegram"]);
    assert_eq!(run(&["decode", &can]).code, Some(0));
    // Text of another kind, and a datagram of which nothing is whole.
    let readme = write("README.md", b"# A title\n\nSome words: a table.\n");
    for command in ["estimate", "decode", "replay"] {
        assert_says(
            &refused(&[command, &readme]),
            &["README.md", "text and no recording", "line 3", "`Some`"],
        );
    }
    let datagram =
        write("bad.bin", b"\x02\x02\x02\x02\x01\0\0\0 a datagram that is cut, and no CRC is right");
    for command in [&["estimate"][..], &["record", "--info"]] {
        assert_says(
            &refused(&[command, &[&datagram]].concat()),
            &["bad.bin", "no SICK telegram", "expected Compact", "CRC"],
        );
    }
    let ranges =
        write("table.csv", b"# rowscan ranges 1; frequency_hz 50; start_deg 0; step_deg 1; unit feet\n");
    assert_says(&refused(&["estimate", &ranges]), &["table.csv", "line 1", "unit mm, cm or m", "`feet`"]);
}

#[test]
fn an_unknown_model_is_named_and_mixed_dialects_are_read() {
    let (_folder, file) = folder();
    let path = file("mixed.bin");
    let mut bytes = b"\x02sRA DeviceIdent 8 NAV350xx 8 1.0.0.0R\x03".to_vec();
    let scan = "sSN LMDscandata 1 1 16F4C7A 0 0 7 9 3E8 4B0 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0";
    rowscan_protocol::frame::encode(rowscan_protocol::frame::Dialect::A, scan.as_bytes(), &mut bytes);
    bytes.extend(b"\x02\x02\x02\x02\0\0\0\x09sAN Run \x014");
    std::fs::write(&path, bytes).expect("written");
    assert_says(&refused(&["replay", &path]), &["NAV350xx", "no model here is", "--model", "--verbatim"]);
    let ended = run(&["estimate", &path, "--format", "json"]);
    let found: Value = serde_json::from_str(&ended.stdout).expect("json");
    assert_eq!((&found["scans"], &found["telegrams_bad"]), (&1.into(), &0.into()));
    assert_says(
        &refused(&["replay", &path, "--model", "lms111", "--from", "scan:9"]),
        &["there is no scan 9", "1 scans"],
    );
    assert_says(
        &refused(&["replay", &path, "--model", "lms111", "--from", "metre:1"]),
        &["needs a rig", "--rig"],
    );
    assert_says(
        &refused(&["replay", &path, "--model", "lms111", "--stream", "x"]),
        &["no stream `x`", "scanner"],
    );
}

#[test]
fn an_output_that_cannot_be_written_is_told_before_anything_is_lost() {
    let (_folder, file) = folder();
    let emulator = Emulator::start(&[&file("row.toml")]);
    let url = emulator.url();
    assert_says(
        &refused(&["record", &url, "-o", "/nowhere/run.mcap"]),
        &["/nowhere/run.mcap", "No such file", "folder"],
    );
    std::fs::write(file("precious.mcap"), b"kept").expect("written");
    assert_says(
        &refused(&["record", &url, "-o", &file("precious.mcap")]),
        &["precious.mcap", "4 bytes already"],
    );
    assert_eq!(std::fs::read(file("precious.mcap")).expect("there"), b"kept");
    // Linux's full disk.
    if Path::new("/dev/full").exists() {
        assert_says(
            &refused(&["record", &url, "-o", "/dev/full"]),
            &["cannot record to /dev/full", "No space left"],
        );
    }
}

/// A program whose files may not grow beyond so many bytes: a disk that fills up, for anybody to have.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_up_on_the_way_is_told_and_what_came_before_is_there() {
    let (_folder, file) = folder();
    let emulator = Emulator::start(&[&file("row.toml")]);
    let path = file("full.mcap");
    let started = std::process::Command::new("sh")
        // Blocks of 512 bytes. The signal that goes with the limit is ignored, so that the write fails as on a full disk.
        .args(["-c", "trap '' XFSZ; ulimit -f 400; exec \"$@\"", "sh"])
        .args([env!("CARGO_BIN_EXE_rowscan"), "record", &emulator.url(), "-o", &path])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it runs");
    let ended = finish(started);
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert_says(&ended.stderr, &["cannot write on to", "full.mcap", "packets are kept up to here"]);
    let len = std::fs::metadata(&path).expect("there").len();
    assert!((150_000..=400 * 512).contains(&len), "{len} bytes");
    let mut recording = Recording::open(Path::new(&path)).expect("it opens");
    let report = rowscan_recording::account(&mut recording).expect("it reads").remove(0);
    assert!(report.scans > 10 && report.scans_lost == Some(0) && report.telegrams_bad == 0, "{report:?}");
    let packets = report.packets_from_device + report.packets_to_device;
    let told =
        ended.stderr.split("; ").find_map(|part| part.split(" packets are kept").next()?.parse::<u64>().ok());
    // What was still in the program's hands when the disk was full is lost; no more than it writes at a time.
    assert!(told.is_some_and(|told| packets <= told && packets + 400 > told), "{packets} of {told:?}");
}
