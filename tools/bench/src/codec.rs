//! Decoding and encoding of scan telegrams, beside copying the same bytes and beside the straightforward way.

use std::fmt::Write;
use std::hint::black_box;

use rowscan_protocol::device::scan_event;
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, checksum};
use rowscan_protocol::telegram::wire::FixedText;
use rowscan_protocol::telegram::{Channel, LmdScandata, Telegram};

use crate::measure::{Case, Report};

/// Beams of a line: 270° in steps of a quarter.
const BEAMS: u32 = 1081;
/// Runs of which the median counts.
const ROUNDS: usize = 41;
/// Telegrams of a run.
const TELEGRAMS: usize = 2000;
/// Telegrams of a run of a slow peer.
const SLOW: usize = 100;
const MAX_PAYLOAD: usize = 64 * 1024;
/// Numbers before a channel's values in the telegram's text, counted from `sSN`: up to and with the number of channels, and
/// from a channel's name to its count.
const HEAD: usize = 20;
const CHANNEL: usize = 6;

const COPY: &str = "memcpy (Vec::extend_from_slice)";
const COPY_AND_SUM: &str = "memcpy and XOR checksum";
const SPLIT: &str = "split-and-parse decoder (str::split, from_str_radix)";
const FORMAT: &str = "write! of every number";
const BYTES: &str = "reader of one number after the other";
const PUSH: &str = "to_be_bytes of one number after the other";

/// 1081 distances and 1081 remissions.
fn scan() -> LmdScandata {
    let values = |name: &[u8; 5], value: fn(u32) -> u32| Channel {
        name: FixedText(*name),
        scale: 1.0,
        start_angle: -450_000,
        step: 2500,
        values: (0..BEAMS).map(|beam| (value(beam) & 0xFFFF) as u16).collect(),
        ..Channel::default()
    };
    // A hash: neighbours differ in length as measured ones do.
    let hash = |beam: u32| beam.wrapping_mul(0x9E37_79B9) >> 8;
    let distance = values(b"DIST1", |_| 0);
    let mut scan = LmdScandata {
        version: 1,
        device_number: 1,
        serial_number: 24_070_042,
        scan_frequency: 2500,
        measurement_frequency: 360,
        ..LmdScandata::default()
    };
    scan.channels16 = vec![distance, values(b"RSSI1", |beam| beam.wrapping_mul(0x9E37_79B9) >> 24)];
    scan.channels16[0].values = (0..BEAMS).map(|beam| (hash(beam) % 20_000) as u16).collect();
    scan
}

/// Runs all cases; every decoder's and encoder's result is checked before it is timed.
pub fn run(report: &mut Report, _: &[String]) {
    let scan = scan();
    for dialect in [Dialect::A, Dialect::B] {
        let mut frame = Vec::new();
        scan_event(dialect, &scan, &mut frame);
        eprintln!("{dialect}: {} bytes a telegram", frame.len());
        decode_cases(report, dialect, &frame, &scan);
        encode_cases(report, dialect, &frame, &scan);
    }
}

fn name(dialect: Dialect, what: &str) -> String {
    let dialect = match dialect {
        Dialect::A => "ascii",
        Dialect::B => "binary",
    };
    format!("{dialect} {what}, {BEAMS} DIST + {BEAMS} RSSI")
}

fn case(dialect: Dialect, what: &str, peer: &'static str, peer_telegrams: usize) -> Case {
    let work = [TELEGRAMS as f64, peer_telegrams as f64];
    Case { name: name(dialect, what), unit: "telegrams/s", peer, threads: 1, work }
}

/// The library's way from bytes of a stream to a telegram's fields.
struct Ours {
    decoder: FrameDecoder,
    scan: LmdScandata,
}

impl Ours {
    fn decode(&mut self, frame: &[u8]) {
        self.decoder.push(frame);
        let frame = self.decoder.next_frame().expect("a frame");
        let telegram = Telegram::parse(frame.dialect, frame.payload).expect("a telegram");
        telegram.args.decode_into(&mut self.scan).expect("a scan");
    }
}

fn decode_cases(report: &mut Report, dialect: Dialect, frame: &[u8], scan: &LmdScandata) {
    let decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
    let mut ours = Ours { decoder, scan: LmdScandata::default() };
    ours.decode(frame);
    assert_eq!(ours.scan, *scan);
    ours.decode(frame);
    let allocations = allocation_counter::measure(|| (0..100).for_each(|_| ours.decode(frame))).count_total;
    assert_eq!(allocations, 0, "decoding allocates");
    let mut ours = || (0..TELEGRAMS).for_each(|_| ours.decode(black_box(frame)));

    let expected: Vec<Vec<u16>> = scan.channels16.iter().map(|channel| channel.values.clone()).collect();
    match dialect {
        Dialect::A => {
            assert_eq!(split_and_parse(frame), expected);
            let peer = || (0..SLOW).for_each(|_| drop(black_box(split_and_parse(black_box(frame)))));
            report.compare(&case(dialect, "decode", SPLIT, SLOW), ROUNDS, &mut ours, peer);
            let mut copy = Vec::new();
            let peer = || (0..TELEGRAMS).for_each(|_| copied(black_box(frame), &mut copy));
            report.compare(&case(dialect, "decode beside a copy", COPY, TELEGRAMS), ROUNDS, ours, peer);
        }
        Dialect::B => {
            assert_eq!(one_by_one(frame), expected);
            let peer = || (0..TELEGRAMS).for_each(|_| drop(black_box(one_by_one(black_box(frame)))));
            report.compare(&case(dialect, "decode", BYTES, TELEGRAMS), ROUNDS, &mut ours, peer);
            let mut copy = Vec::new();
            let peer = || (0..TELEGRAMS).for_each(|_| copied_and_summed(black_box(frame), &mut copy));
            report.compare(
                &case(dialect, "decode beside a copy", COPY_AND_SUM, TELEGRAMS),
                ROUNDS,
                ours,
                peer,
            );
        }
    }
}

fn encode_cases(report: &mut Report, dialect: Dialect, frame: &[u8], scan: &LmdScandata) {
    let mut out = Vec::new();
    let mut encode = || {
        out.clear();
        scan_event(dialect, black_box(scan), &mut out);
        black_box(&out);
    };
    encode();
    let allocations = allocation_counter::measure(|| (0..100).for_each(|_| encode())).count_total;
    assert_eq!(allocations, 0, "encoding allocates");
    let mut ours = || (0..TELEGRAMS).for_each(|_| encode());
    let mut copy = Vec::new();
    match dialect {
        Dialect::A => {
            assert!(frame.windows(7).any(|part| part == b" DIST1 "));
            let peer = || (0..SLOW).for_each(|_| drop(black_box(formatted(black_box(scan)))));
            report.compare(&case(dialect, "encode", FORMAT, SLOW), ROUNDS, &mut ours, peer);
            let peer = || (0..TELEGRAMS).for_each(|_| copied(black_box(frame), &mut copy));
            report.compare(&case(dialect, "encode beside a copy", COPY, TELEGRAMS), ROUNDS, ours, peer);
        }
        Dialect::B => {
            let peer = || (0..TELEGRAMS).for_each(|_| drop(black_box(pushed(black_box(scan)))));
            report.compare(&case(dialect, "encode", PUSH, TELEGRAMS), ROUNDS, &mut ours, peer);
            let peer = || (0..TELEGRAMS).for_each(|_| copied_and_summed(black_box(frame), &mut copy));
            report.compare(
                &case(dialect, "encode beside a copy", COPY_AND_SUM, TELEGRAMS),
                ROUNDS,
                ours,
                peer,
            );
        }
    }
}

fn copied(frame: &[u8], copy: &mut Vec<u8>) {
    copy.clear();
    copy.extend_from_slice(frame);
    black_box(copy);
}

fn copied_and_summed(frame: &[u8], copy: &mut Vec<u8>) {
    copied(frame, copy);
    black_box(checksum(&copy[8..copy.len() - 1]));
}

/// Text to numbers as most clients do it: all tokens first, then one `from_str_radix` each.
fn split_and_parse(frame: &[u8]) -> Vec<Vec<u16>> {
    let text = std::str::from_utf8(&frame[1..frame.len() - 1]).expect("text");
    let tokens: Vec<String> = text.split(' ').map(str::to_owned).collect();
    let number = |at: usize| usize::from_str_radix(&tokens[at], 16).expect("a number");
    let mut at = HEAD;
    (0..number(HEAD - 1))
        .map(|_| {
            let values = at + CHANNEL;
            at = values + number(values - 1);
            let value = |token: &String| u16::from_str_radix(token, 16).expect("a number");
            tokens[values..at].iter().map(value).collect()
        })
        .collect()
}

/// Binary to numbers, each on its own, after the checksum.
fn one_by_one(frame: &[u8]) -> Vec<Vec<u16>> {
    let (payload, sum) = (&frame[8..frame.len() - 1], frame[frame.len() - 1]);
    assert_eq!(payload.iter().fold(0, |sum, byte| sum ^ byte), sum);
    let number = |at: usize| u16::from_be_bytes([payload[at], payload[at + 1]]);
    // `sSN LMDscandata `, the head without encoders; a channel's head.
    let mut at = 16 + 38 + 2;
    (0..number(at - 2))
        .map(|_| {
            let values = at + 21;
            let count = usize::from(number(values - 2));
            at = values + 2 * count;
            (0..count).map(|beam| number(values + 2 * beam)).collect()
        })
        .collect()
}

/// The channels' text, number by number.
fn formatted(scan: &LmdScandata) -> String {
    let mut out = String::new();
    for channel in &scan.channels16 {
        write!(out, " {} {:08X}", channel.name, channel.scale.to_bits()).expect("memory");
        channel.values.iter().for_each(|value| write!(out, " {value:X}").expect("memory"));
    }
    out
}

/// The channels' bytes, number by number, and their checksum.
fn pushed(scan: &LmdScandata) -> Vec<u8> {
    let mut out = Vec::new();
    for channel in &scan.channels16 {
        channel.values.iter().for_each(|value| out.extend_from_slice(&value.to_be_bytes()));
    }
    out.push(out.iter().fold(0, |sum, byte| sum ^ byte));
    out
}
