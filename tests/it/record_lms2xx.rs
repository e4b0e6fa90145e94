//! A classic LMS2xx from the line to the recording and back. Alone in its file: its client's reply time-outs are real time, and tests of one
//! file run side by side.
#![cfg(target_os = "linux")]

use crate::common;

use std::io::{Read, Write};
use std::process::Stdio;
use std::time::Duration;

use common::binary::{Emulator, assert_says, finish, interrupt, refused, rowscan, run};
use common::recorded::{estimate, folder};
use rowscan_recording::{Recording, Side};
use serde_json::Value;

#[test]
fn an_lms2xx_is_recorded_replayed_exported_and_estimated_alike() {
    let (_folder, file) = folder();
    let (rig, recorded, link) = (file("row.toml"), file("run.mcap"), file("lms"));
    let at_device = file("device.mcap");
    let args = [&rig, "--model", "lms291", "--pty", &link, "--time-scale", "max", "--record", &at_device];
    let emulator = Emulator::on_a_line("emulate", &args);
    let scans = ["--model", "lms291", "--scans", "25"];
    let source = format!("serial:{link}");
    let live = estimate(&source, &rig, &[&scans[..], &["--record", &recorded]].concat());
    let found: Value = serde_json::from_str(&live).expect("json");
    assert_eq!((&found["scans"], &found["scans_lost"]), (&25.into(), &0.into()));
    assert!(found["impacted_total_area_m2"].as_f64().expect("known") > 0.0);
    emulator.end();

    assert_eq!(estimate(&recorded, &rig, &scans), live, "the host's recording");
    assert_eq!(estimate(&at_device, &rig, &scans), live, "the device's recording");
    let again = file("lms-again");
    let replay = Emulator::on_a_line("replay", &[&recorded, "--pty", &again, "--time-scale", "max"]);
    assert_eq!(estimate(&format!("serial:{again}"), &rig, &scans), live, "the replay");
    drop(replay);
    every_byte_reaches_a_client_that_reads_late(&recorded, &file("late"));
    what_is_lost_swapped_or_begun_anew_is_counted(&recorded, &file("changed.bin"), &rig);

    let ranges = file("ranges.csv");
    let ended = run(&["export", &recorded, "--to", "csv", "--what", "scans", "-o", &ranges]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert!(!ended.stderr.contains("no counters"), "the driver asks for the index: {}", ended.stderr);
    let text = std::fs::read_to_string(&ranges).expect("written");
    assert!(text.lines().count() >= 25 + 2, "{} lines", text.lines().count());
    let info = run(&["record", "--info", &recorded, "--format", "json"]);
    let info: Value = serde_json::from_str(&info.stdout).expect("json");
    assert_eq!(info["streams"][0]["kind"], "lms2xx");
    assert!(info["streams"][0]["scans"].as_u64().expect("counted") >= 25);

    // One line, and nobody who speaks another language.
    assert_says(
        &refused(&["replay", &recorded, "--tcp", "127.0.0.1:0", "--pty", &file("two")]),
        &["one serial line"],
    );
    assert_says(
        &refused(&["replay", &recorded, "--pty", &file("no"), "--model", "lms111"]),
        &["is lms2xx", "LMS111"],
    );
}

/// The system throws away what a pseudo-terminal's client has not read when the other end closes, so the replay stays until it is read.
fn every_byte_reaches_a_client_that_reads_late(recorded: &str, link: &str) {
    let info = run(&["record", "--info", recorded, "--format", "json"]);
    let info: Value = serde_json::from_str(&info.stdout).expect("json");
    let scans = info["streams"][0]["scans"].as_u64().expect("counted") as usize;
    let _replay = Emulator::on_a_line("replay", &[recorded, "--pty", link, "--time-scale", "max"]);
    let mut line = std::fs::OpenOptions::new().read(true).write(true).open(link).expect("a port");
    // SICK's telegram listing: stream all values.
    line.write_all(&[0x02, 0x00, 0x02, 0x00, 0x20, 0x24, 0x34, 0x08]).expect("written");
    // 361 values of two bytes, and some 10 bytes around them.
    let telegram = 2 * 361;
    let (mut bytes, mut chunk) = (Vec::new(), [0; 512]);
    while let Ok(read @ 1..) = line.read(&mut chunk) {
        bytes.extend_from_slice(&chunk[..read]);
        // All but what the line's buffer holds has been read: what the replay has left to do is to end.
        if bytes.len() > (scans - 3) * telegram {
            std::thread::sleep(Duration::from_millis(150));
        }
    }
    let found = bytes.windows(5).filter(|head| matches!(head, [0x02, 0x80, _, 0x02, 0xB0])).count();
    assert_eq!(found, scans, "{} bytes", bytes.len());
}

/// Telegrams of values are counted by both of their indices: 16 turns a telegram make the index of turns go round every 16 of them.
fn what_is_lost_swapped_or_begun_anew_is_counted(recorded: &str, changed: &str, rig: &str) {
    let mut recording = Recording::open(recorded.as_ref()).expect("it opens");
    let mut bytes = Vec::new();
    while let Some(packet) = recording.next_packet().expect("it reads") {
        bytes.extend((packet.from == Some(Side::Device)).then_some(packet.bytes).into_iter().flatten());
    }
    let heads = (0..bytes.len()).filter(|at| matches!(bytes[*at..], [0x02, 0x80, _, 0x02, 0xB0, ..]));
    // Address, length, values, checksum; the last one may be cut.
    let telegram =
        |at: usize| bytes.get(at..at + usize::from(u16::from_le_bytes([bytes[at + 2], bytes[at + 3]])) + 6);
    let sent: Vec<&[u8]> = heads.filter_map(telegram).collect();
    let told = |order: &[usize]| {
        std::fs::write(changed, order.iter().flat_map(|n| sent[*n]).copied().collect::<Vec<u8>>())
            .expect("written");
        let info = run(&["record", "--info", changed, "--format", "json"]);
        let info: Value = serde_json::from_str(&info.stdout).expect("json");
        let counted = ["scans", "scans_lost", "scans_late", "scans_repeated", "restarts"]
            .map(|key| info["streams"][0][key].as_u64());
        let estimate = run(&["estimate", changed, "--rig", rig, "--model", "lms291", "--format", "json"]);
        let estimate: Value = serde_json::from_str(&estimate.stdout).expect("json");
        let of_estimate =
            ["scans", "scans_lost", "scans_late", "scans_repeated"].map(|key| estimate[key].as_u64());
        assert_eq!(of_estimate, counted[..4], "{order:?}");
        (counted, estimate["advance_m"].as_f64().expect("known"))
    };
    let all: Vec<usize> = (0..sent.len()).collect();
    let count = sent.len() as u64;
    let (counted, whole_m) = told(&all);
    assert_eq!(counted, [Some(count), Some(0), Some(0), Some(0), Some(0)]);
    for lost in [1, 5, 15, 16, 17] {
        let order = [&all[..3], &all[3 + lost..]].concat();
        let (counted, advance_m) = told(&order);
        let lost = lost as u64;
        assert_eq!(counted, [Some(count - lost), Some(lost), Some(0), Some(0), Some(0)], "{lost} lost");
        assert!((advance_m - whole_m).abs() < 1e-6, "{lost} lost: {advance_m} of {whole_m} m");
    }
    let mut swapped = all.clone();
    swapped.swap(9, 10);
    assert_eq!(told(&swapped).0, [Some(count), Some(0), Some(1), Some(0), Some(0)], "swapped");
    let again = [&all[..10], &all[8..]].concat();
    assert_eq!(told(&again), ([Some(count + 2), Some(0), Some(0), Some(2), Some(0)], whole_m), "again");
    // From before the first: its indices began anew.
    let (counted, _) = told(&[&all[12..], &all[..12]].concat());
    assert_eq!(counted, [Some(count), None, Some(0), Some(0), Some(1)], "anew");
}

/// A model that the scanner is not, by its own name: told where it is read, and where it is replayed.
#[test]
fn a_scanner_of_another_model_than_it_is_taken_for_is_told() {
    let (_folder, file) = folder();
    let (rig, link, recorded) = (file("row.toml"), file("lms"), file("run.mcap"));
    let args = [&rig, "--model", "lms200", "--pty", &link, "--time-scale", "max"];
    let emulator = Emulator::on_a_line("emulate", &args);
    let read = |model: &str, more: &[&str]| {
        let source = format!("serial:{link}");
        run(&[&["estimate", &source, "--rig", &rig, "--model", model, "--scans", "5"], more].concat())
    };
    let told = read("lms291", &["--record", &recorded]).stderr;
    assert_says(
        &told,
        &["the scanner is called LMS200, and is taken for the model LMS291-S05", "--model lms200"],
    );
    let told = read("lms200", &[]).stderr;
    assert!(!told.contains("is taken for"), "{told}");
    emulator.end();
    let mut command = rowscan();
    command.args(["replay", &recorded, "--pty", &file("again"), "--model", "lms291", "--format", "jsonl"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary runs");
    let mut line = [0; 1];
    child.stdout.as_mut().expect("piped").read_exact(&mut line).expect("it listens");
    std::thread::sleep(Duration::from_millis(300));
    interrupt(&child);
    let told = finish(child).stderr;
    assert_says(&told, &["the scanner is called LMS200, and is taken for the model LMS291-S05"]);
}
