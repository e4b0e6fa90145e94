//! Whatever a file holds, in whatever form: exit 0 only if a scan came out, and else a reason.

use crate::common;

use std::io::Cursor;
use std::path::Path;

use common::binary::{Ended, run};
use common::captured::Talk;
use common::recorded::folder;
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::lms2xx;
use rowscan_recording::{About, Decoded, McapWriter, Side, StreamKind};
use serde_json::Value;

/// Rounds for each kind of file and command.
const ROUNDS: usize = 12;

/// The same numbers in every run (PCG's multiplier and increment).
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound.max(1)
    }
}

fn scan(dialect: Dialect, counter: u16) -> Vec<u8> {
    use rowscan_protocol::telegram::LmdScandata;
    use rowscan_protocol::telegram::lmd_scandata::Channel;
    use rowscan_protocol::telegram::wire::FixedText;
    let channel = Channel {
        name: FixedText(*b"DIST1"),
        scale: 1.0,
        step: 5000,
        values: vec![1000, 0, 2000],
        ..Channel::default()
    };
    let scan = LmdScandata {
        version: 1,
        telegram_counter: counter,
        scan_time_us: u32::from(counter) * 20_000,
        scan_frequency: 5000,
        channels16: vec![channel],
        ..LmdScandata::default()
    };
    let mut bytes = Vec::new();
    rowscan_protocol::device::scan_event(dialect, &scan, &mut bytes);
    bytes
}

/// One file of every form that holds scans, and one of each that holds none.
fn files(capture: &Path) -> Vec<(&'static str, Vec<u8>)> {
    let mut talk = Talk::new();
    talk.connect(50_000, 1);
    (1..=6).for_each(|number| talk.scan(50_000, number));
    talk.write(capture.to_str().expect("UTF-8"));
    let mut writer =
        McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).expect("written");
    let stream = writer.add_stream("scanner", StreamKind::Cola).expect("written");
    for counter in 0..6 {
        let at_ns = 1_700_000_000_000_000_000 + u64::from(counter) * 20_000_000;
        writer.write(stream, Side::Device, at_ns, 0, &scan(Dialect::B, counter)).expect("written");
    }
    writer.finish().expect("written");
    let raw = |dialect| (0..6).flat_map(|counter| scan(dialect, counter)).collect::<Vec<u8>>();
    let hex = raw(Dialect::A).iter().map(|byte| format!("{byte:02X} ")).collect::<String>();
    let mut serial = Vec::new();
    for _ in 0..6 {
        // 181 values in centimetres, then the status.
        let mut body = vec![0xB0, 181, 0];
        (0..181_u16).for_each(|value| body.extend((100 + value).to_le_bytes()));
        body.push(0x10);
        lms2xx::frame::encode(lms2xx::frame::FROM_DEVICE, &body, &mut serial);
    }
    let mut others = Vec::new();
    encode(Dialect::B, b"sSN LMDradardata \x01\x02", &mut others);
    let ranges = "# rowscan ranges 1; frequency_hz 50; start_deg 0; step_deg 1; unit mm\n\
                  time_s,telegram_counter,scan_time_us,range_0,range_1\n0,1,0,1000,0\n0.02,2,20000,1000,2000\n";
    vec![
        ("mcap", writer.into_inner().into_inner()),
        ("capture", std::fs::read(capture).expect("written")),
        ("CoLa A", raw(Dialect::A)),
        ("CoLa B", raw(Dialect::B)),
        ("hex", hex.into_bytes()),
        ("LMS2xx", serial),
        ("ranges", ranges.as_bytes().to_vec()),
        ("radar", others),
        ("candump", b"(1700000000.000001) can0 18FEF100#0102\n".to_vec()),
        ("noise", b"\x91\x02s\xA7\x03\x00\xFF\x02sz\x05\x03".repeat(40)),
        ("nothing", Vec::new()),
    ]
}

/// A file as it is, then cut, flipped, and with noise behind.
fn damaged(whole: &[u8], round: usize, numbers: &mut Numbers) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    if round > 0 {
        bytes.truncate(bytes.len() - numbers.below(bytes.len() / 2 + 1) * (round % 2));
        for _ in 0..round {
            let at = numbers.below(bytes.len());
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << numbers.below(8);
            }
        }
        bytes.extend((0..numbers.below(300) * (round % 3)).map(|_| numbers.below(256) as u8));
    }
    bytes
}

#[test]
fn every_command_that_reads_a_recording_tells_the_same_damage_and_refuses_what_holds_no_telegram() {
    let (_folder, file) = folder();
    let (path, table, copy) = (file("any"), file("any.csv"), file("copy.mcap"));
    let mut numbers = Numbers(23);
    let (mut damaged_files, mut sound, mut refused) = (0, 0, 0);
    for (name, whole) in files(file("any.pcap").as_ref()) {
        for round in 0..ROUNDS {
            std::fs::write(&path, damaged(&whole, round, &mut numbers)).expect("written");
            let told = [
                run(&["record", "--info", &path]),
                run(&["record", &path, "-o", &copy]),
                run(&["estimate", &path]),
                run(&["export", &path, "--to", "csv", "-o", &table]),
            ];
            let damage = |told: &Ended| {
                let line = told.stderr.lines().find_map(|line| line.split_once(" telegrams cannot be read"));
                line.and_then(|(head, _)| head.rsplit(": ").next().map(str::to_owned))
            };
            let context = told.each_ref().map(|told| (told.code, told.stderr.clone()));
            let context = format!("{name}, round {round}: {context:?}");
            let [info, ..] = &told;
            // Whoever reads the file to its end says what is bad in it, and in the same numbers.
            assert!(told.iter().all(|other| damage(other) == damage(info)), "{context}");
            let is_refused = |told: &Ended| told.stderr.contains("holds no SICK telegram");
            let _ = std::fs::remove_file(&copy);
            match damage(info) {
                Some(_) => damaged_files += 1,
                None if is_refused(info) => {
                    assert!(told.iter().all(|told| is_refused(told) && told.code == Some(2)), "{context}");
                    assert_eq!(run(&["decode", &path]).code, Some(2), "{context}");
                    refused += 1;
                }
                None => sound += 1,
            }
        }
    }
    assert!(
        damaged_files > 20 && sound > 20 && refused > 10,
        "{damaged_files} damaged, {sound} sound, {refused} refused"
    );
}

#[test]
fn exit_0_means_that_a_scan_came_out_and_anything_else_has_a_reason() {
    let (_folder, file) = folder();
    let (path, table) = (file("any"), file("any.csv"));
    let mut numbers = Numbers(14);
    let (mut with_scans, mut without) = (0, 0);
    for (name, whole) in files(file("any.pcap").as_ref()) {
        for round in 0..ROUNDS {
            std::fs::write(&path, damaged(&whole, round, &mut numbers)).expect("written");
            let context = |said: &str| format!("{name}, round {round}: {said}");

            let told = run(&["estimate", &path, "--format", "json"]);
            let scans = serde_json::from_str::<Value>(&told.stdout)
                .map_or(0, |found| found["scans"].as_u64().expect("a count"));
            assert!(
                told.code == Some(0) || told.code == Some(1) || told.code == Some(2),
                "{}",
                context(&told.stderr)
            );
            assert!(told.code != Some(0) || scans > 0, "{}", context(&told.stderr));
            assert!(told.code == Some(0) || !told.stderr.trim().is_empty(), "{}", context("no reason"));

            let _ = std::fs::remove_file(&table);
            let told = run(&["export", &path, "--to", "csv", "--what", "scans", "-o", &table]);
            let rows =
                std::fs::read_to_string(&table).map_or(0, |text| text.lines().count().saturating_sub(2));
            // A table there is one with scans, and whole; of a damaged recording it is what was read, and a finding.
            let is_torn = ["broken off", "damaged at byte"].iter().any(|why| told.stderr.contains(why));
            let is_part = told.code == Some(1) && is_torn;
            assert_eq!(told.code == Some(0) || is_part && rows > 0, rows > 0, "{}", context(&told.stderr));
            let has_reason = is_part || told.stderr.contains("rowscan: ");
            assert!(told.code == Some(0) || has_reason, "{}", context("no reason"));
            if rows > 0 { with_scans += 1 } else { without += 1 }
        }
    }
    assert!(with_scans > 30 && without > 30, "{with_scans} with scans, {without} without");
}

/// Datagrams of a scanner whose turns come in two segments.
fn compact(turns: u64) -> Vec<Vec<u8>> {
    use rowscan_protocol::compact::{
        Beams, Module, Modules, PerLine, ScanTelegram, Shape, Telegram, theta_code,
    };
    const BEAMS: u32 = 5;
    let datagram = |counter: u64| {
        let (frame_number, segment_counter) = (counter / 2, counter % 2);
        let deg = |beam: u32| f64::from(beam) + (BEAMS as u64 * segment_counter) as f64 - 10.0;
        let begins_us = 1_000_000 + counter * 33_333;
        let module = Module {
            segment_counter,
            frame_number,
            shape: Shape { lines: 1, beams: BEAMS, echoes: 1 },
            time_start_us: PerLine(vec![begins_us]),
            time_stop_us: PerLine(vec![begins_us + 1000]),
            phi_rad: PerLine(vec![0.0]),
            theta_start_rad: PerLine(vec![deg(0).to_radians() as f32]),
            theta_stop_rad: PerLine(vec![deg(BEAMS - 1).to_radians() as f32]),
            beams: Beams {
                distance: vec![3000; BEAMS as usize],
                rssi: vec![257; BEAMS as usize],
                properties: vec![0; BEAMS as usize],
                theta: (0..BEAMS).map(|beam| theta_code(deg(beam).to_radians())).collect(),
            },
            ..Module::default()
        };
        let modules = Modules(vec![module]);
        let scan = ScanTelegram { telegram_counter: counter, modules, ..ScanTelegram::default() }.seal();
        let mut bytes = Vec::new();
        Telegram::Scan(scan).encode(&mut bytes).expect("lists of their lengths");
        bytes
    };
    (0..2 * turns).map(datagram).collect()
}

#[test]
fn a_damaged_datagram_is_one_bad_telegram_and_one_lost_segment_to_every_command() {
    let (_folder, file) = folder();
    let path = file("any.mcap");
    let mut numbers = Numbers(31);
    let whole = compact(30);
    for damaged in [0, 1, 2, 5, 9] {
        let mut datagrams = whole.clone();
        // None of the first and the last turn, which may be cut, and none beside another.
        for datagram in datagrams.iter_mut().skip(3).step_by(6).take(damaged) {
            let at = numbers.below(datagram.len());
            datagram[at] ^= 1 << numbers.below(8);
        }
        let mut writer =
            McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).expect("written");
        let stream = writer.add_stream("scanner", StreamKind::Compact).expect("written");
        for (number, datagram) in (0..).zip(&datagrams) {
            let at_ns = 1_700_000_000_000_000_000 + number * 33_333_000;
            writer.write(stream, Side::Device, at_ns, 0, datagram).expect("written");
        }
        writer.finish().expect("written");
        std::fs::write(&path, writer.into_inner().into_inner()).expect("written");

        let info = run(&["record", "--info", &path, "--format", "json"]);
        let found = run(&["estimate", &path, "--format", "json"]);
        let decoded = run(&["decode", &path]);
        let json = |told: &Ended| serde_json::from_str::<Value>(&told.stdout).expect("JSON");
        let (of_info, of_estimate) = (json(&info)["streams"][0].clone(), json(&found));
        let expected = Value::from(damaged);
        for told in [&of_info, &of_estimate] {
            assert_eq!((&told["telegrams_bad"], &told["segments_lost"]), (&expected, &expected), "{told}");
            assert_eq!(told["scans"], 30, "{told}");
        }
        let total = whole.len();
        let words = format!("{damaged} of {total} telegrams cannot be read");
        for told in [&info, &found] {
            assert_eq!(told.stderr.contains(&words), damaged > 0, "{}", told.stderr);
        }
        let words = format!("{} telegrams, 0 lines opaque, {damaged} bad", total - damaged);
        assert!(decoded.stderr.contains(&words), "expected {words}, found {}", decoded.stderr);
        assert_eq!(decoded.code, Some(i32::from(damaged > 0)));
    }
}
