//! `rowscan decode`: recordings, captures, hex and damage, through the whole binary.

use crate::common;

use std::io::Write;
use std::path::Path;
use std::process::Stdio;

use common::binary::{Ended, finish, rowscan, run, text};
use common::facts;
use rowscan_protocol::frame::{Dialect, encode};
use serde_json::Value;

/// All recordings with raw frames.
const RECORDINGS: [&str; 5] = [
    "lms111_startup_first88",
    "lms511_20210302",
    "tim781s_20210125",
    "tim781s_fieldset_events",
    "mrs1104_20210722",
];

/// Decodes bytes from standard input; the lines.
fn decode(bytes: &[u8]) -> (Ended, Vec<Value>) {
    let mut child = rowscan()
        .args(["decode", "-", "--format", "jsonl"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    child.stdin.take().expect("piped").write_all(bytes).expect("it reads");
    let ended = finish(child);
    let lines = ended.stdout.lines().map(|line| serde_json::from_str(line).expect("json")).collect();
    (ended, lines)
}

fn frame(dialect: Dialect, payload: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    encode(dialect, payload, &mut out);
    out
}

fn decode_file(path: &Path) -> Vec<Value> {
    let ended = run(&["decode", path.to_str().expect("UTF-8"), "--format", "jsonl"]);
    assert_eq!(ended.code, Some(0), "{}: {}", path.display(), ended.stderr);
    ended.stdout.lines().map(|line| serde_json::from_str(line).expect("json")).collect()
}

#[test]
fn every_recorded_frame_is_named_or_opaque_with_its_length() {
    let Some(facts) = facts("decoding real recordings") else { return };
    let folder = facts.join("protocol/recordings");
    for name in RECORDINGS {
        let about = std::fs::read_to_string(folder.join(format!("{name}.json"))).expect("described");
        let about: Value = serde_json::from_str(&about).expect("json");
        for (direction, side) in [("h2d", "host"), ("d2h", "device")] {
            let path = folder.join(format!("{name}.{direction}.bin"));
            let frames: Vec<&Value> =
                about["index"].as_array().expect("listed").iter().filter(|at| at[1] == direction).collect();
            if frames.is_empty() {
                continue;
            }
            let lines = decode_file(&path);
            assert_eq!(lines.len(), frames.len(), "{name}.{direction}");
            for (line, at) in lines.iter().zip(frames) {
                assert_eq!((&line["offset"], &line["length"]), (&at[2], &at[3]), "{name}: {line}");
                assert_eq!(line["from"], side, "{name}: {line}");
                let words = line["words"].as_str().expect("words");
                assert!(line["fields"].is_object() || line["is"] == "opaque", "{line}");
                match line["is"].as_str() {
                    Some("telegram") => assert!(!words.contains("opaque"), "{line}"),
                    Some("opaque") => {
                        assert!(words.contains("opaque, ") && words.ends_with(" bytes"), "{line}")
                    }
                    other => panic!("{name}: {other:?} in {line}"),
                }
                // Only evaluation fields, and an event of a scanner that is no model here: docs/decode.md lists them.
                let name = line["name"].as_str().unwrap_or_default();
                let may_be_opaque = name.starts_with("field");
                assert!(line["is"] == "telegram" || may_be_opaque, "{line}");
            }
        }
    }
    let lines = decode_file(&folder.join("lms2xx_commands.hex"));
    assert!(lines.iter().any(|line| line["fields"]["request"] == "mode"));
    // Opaque is what is not taken apart, and nothing else.
    let is_told = |line: &Value| line["fields"].is_object() == (line["is"] == "telegram");
    assert!(lines.iter().all(|line| line["dialect"] == "LMS2xx" && is_told(line)));
    assert!(
        lines.iter().any(|line| line["is"] == "telegram") && lines.iter().any(|line| line["is"] == "opaque")
    );
    assert!(lines.len() > 15);
}

#[test]
fn a_scan_is_told_by_the_names_of_its_fields() {
    let scan = "sSN LMDscandata 1 1 16F4C7A 0 0 7 9 3E8 4B0 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0";
    let (ended, lines) = decode(&frame(Dialect::A, scan.as_bytes()));
    assert_eq!(ended.code, Some(0));
    let words = lines[0]["words"].as_str().expect("words");
    for part in [
        "scan_counter: 9",
        "scan_time_us: 1000 µs",
        "start_angle: -450000 × 1/10000°",
        "values: [1000, 0, 2000]",
    ] {
        assert!(words.contains(part), "{words}");
    }
    let fields = &lines[0]["fields"];
    assert_eq!((&fields["scan_counter"], &fields["scan_time_us"]), (&9.into(), &1000.into()));
    assert_eq!(fields["channels16"][0]["name"], "DIST1");
    assert_eq!(fields["channels16"][0]["start_angle"], -450_000);
    assert_eq!(fields["channels16"][0]["values"], serde_json::json!([1000, 0, 2000]));
    assert!(fields["position"].is_null() && fields["encoders"] == serde_json::json!([]));
}

/// A start-up, two scans, damage between them.
fn start_up() -> Vec<u8> {
    let scan = b"sSN LMDscandata 1 1 1 0 0 7 9 3E8 4B0 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 1 3E8 0 0 0 0 0 0";
    let payloads: [&[u8]; 5] = [b"sMN Run", b"sAN Run 1", b"sEN LMDscandata 1", b"sEA LMDscandata 1", scan];
    let mut bytes = payloads.map(|payload| frame(Dialect::A, payload)).concat();
    bytes.extend(b"junk");
    bytes.extend(frame(Dialect::A, scan));
    bytes
}

#[test]
fn telegrams_are_chosen_by_name_and_kind() {
    let kinds = |flags: &[&str]| {
        let mut child = rowscan()
            .args([&["decode", "-", "--format", "jsonl"], flags].concat())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary runs");
        child.stdin.take().expect("piped").write_all(&start_up()).expect("it reads");
        let ended = finish(child);
        assert_eq!(ended.code, Some(1), "damage is a finding, shown or not: {}", ended.stderr);
        let line = |line: &str| {
            let line: Value = serde_json::from_str(line).expect("json");
            line["kind"].as_str().unwrap_or("bad").to_owned()
        };
        ended.stdout.lines().map(line).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(kinds(&[]), "sMN sAN sEN sEA sSN bad sSN");
    assert_eq!(kinds(&["--only", "Run"]), "sMN sAN bad");
    assert_eq!(kinds(&["--only", "Run", "--only", "LMDscandata"]), "sMN sAN sEN sEA sSN bad sSN");
    assert_eq!(kinds(&["--not", "Run"]), "sEN sEA sSN bad sSN");
    assert_eq!(kinds(&["--events"]), "sSN bad sSN");
    assert_eq!(kinds(&["--events", "--not", "LMDscandata"]), "bad");
}

#[test]
fn damage_is_located_and_what_follows_is_still_read() {
    let good = frame(Dialect::B, b"sMN Run");
    let mut flipped = frame(Dialect::B, b"sRN ODoprh");
    flipped[11] ^= 1;
    let too_short = frame(Dialect::B, b"sMN SetAccessMode \x03\xF4\x72");
    let no_number = frame(Dialect::A, b"sMN SetAccessMode 3 F47Z4744");
    let parts = [&good[..], &flipped, b"junk", &too_short, &no_number, &[0], &good];
    let (ended, lines) = decode(&parts.concat());
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    let starts: Vec<u64> =
        parts.iter().scan(0, |at, part| Some(std::mem::replace(at, *at + part.len() as u64))).collect();
    let found: Vec<(u64, &str)> = lines
        .iter()
        .map(|line| (line["offset"].as_u64().expect("a place"), line["is"].as_str().expect("said")))
        .collect();
    let kinds = ["telegram", "bad", "bad", "bad", "bad", "opaque", "telegram"];
    assert_eq!(found, starts.iter().copied().zip(kinds).collect::<Vec<_>>());
    let error = |line: &Value| {
        let text = |key: &str| line[key].as_str().expect("said").to_owned();
        (line["error_offset"].as_u64().expect("a place"), text("expected"), text("found"))
    };
    // XOR of the bytes as they are against the byte behind them.
    let sum = flipped[8..18].iter().fold(0, |sum, b| sum ^ b);
    assert_eq!(
        error(&lines[1]),
        (starts[1] + 18, format!("checksum {sum:02X}"), format!("{:02X}", flipped[18]))
    );
    assert_eq!(error(&lines[2]), (starts[2], "02, the start of a frame".to_owned(), "6A".to_owned()));
    // The number of four bytes begins behind the level.
    assert_eq!(error(&lines[3]), (starts[3] + 8 + 19, "a 32-bit number".to_owned(), "the end".to_owned()));
    assert_eq!(
        error(&lines[4]),
        (starts[4] + 1 + 20, "a 32-bit number".to_owned(), "\"F47Z4744\"".to_owned())
    );
}

#[test]
fn hex_with_comments_is_read_line_by_line() {
    let hex = |bytes: &[u8]| bytes.iter().map(|b| format!("{b:02x} ")).collect::<String>();
    let run = frame(Dialect::B, b"sMN Run");
    let text = format!(
        "; start-up\n{}; log out\n\n{}; cut short\n{}\n",
        hex(&run),
        hex(&run[..12]),
        hex(&frame(Dialect::A, b"sRN ODpwrc"))
    );
    let (ended, lines) = decode(text.as_bytes());
    assert_eq!(ended.code, Some(1));
    let is: Vec<&str> = lines.iter().map(|line| line["is"].as_str().expect("said")).collect();
    assert_eq!(is, ["telegram", "bad", "telegram"]);
    assert_eq!((&lines[1]["offset"], &lines[1]["found"]), (&16.into(), &"the end".into()));
    assert_eq!(lines[2]["name"], "ODpwrc");
}

#[test]
fn what_holds_no_telegram_is_bad_input() {
    for bytes in [&b"\x00\x01\x02\x03 nothing here"[..], b"", b"some text"] {
        let (ended, _) = decode(bytes);
        assert_eq!(ended.code, Some(2), "{bytes:?}: {}", ended.stderr);
        assert!(ended.stderr.contains("standard input"), "{}", ended.stderr);
    }
}

const HOST: ([u8; 4], u16) = ([192, 168, 0, 5], 50_000);
const DEVICE: ([u8; 4], u16) = ([192, 168, 0, 1], 2112);

/// An Ethernet packet; `vlan` puts a tag in.
fn packet(
    from: ([u8; 4], u16),
    to: ([u8; 4], u16),
    sequence: u32,
    flags: u8,
    data: &[u8],
    vlan: bool,
) -> Vec<u8> {
    let mut packet = vec![0; 12];
    if vlan {
        packet.extend([0x81, 0x00, 0x00, 0x07]);
    }
    packet.extend([0x08, 0x00, 0x45, 0]);
    packet.extend((40 + data.len() as u16).to_be_bytes());
    packet.extend([0, 0, 0x40, 0, 64, 6, 0, 0]);
    packet.extend([from.0, to.0].concat());
    packet.extend([from.1.to_be_bytes(), to.1.to_be_bytes()].concat());
    packet.extend(sequence.to_be_bytes());
    packet.extend([0, 0, 0, 0, 0x50, flags, 0, 0, 0, 0, 0, 0]);
    packet.extend(data);
    // Ethernet pads short packets.
    packet.resize(packet.len().max(60), 0xEE);
    packet
}

/// A conversation: SYN both ways, a request in two pieces and out of order, one reply twice, an event cut by a lost packet.
fn conversation() -> Vec<Vec<u8>> {
    let request = frame(Dialect::B, b"sRN DeviceIdent");
    let reply = frame(Dialect::B, b"sRA DeviceIdent \0\x06LMS111\0\x05V1.80");
    let (first, second) = request.split_at(9);
    let to_device = |at: u32, data: &[u8]| packet(HOST, DEVICE, 1000 + at, 0x18, data, false);
    let to_host = |at: u32, data: &[u8]| packet(DEVICE, HOST, 5000 + at, 0x18, data, true);
    vec![
        packet(HOST, DEVICE, 999, 0x02, &[], false),
        packet(DEVICE, HOST, 4999, 0x12, &[], true),
        to_device(9, second),
        to_device(0, first),
        to_host(0, &reply),
        to_host(0, &reply),
        to_host(reply.len() as u32 + 40, &reply),
        packet(([10, 0, 0, 1], 80), HOST, 1, 0x18, b"GET / HTTP/1.1", false),
    ]
}

fn assert_is_the_conversation(file: &[u8]) {
    let (ended, lines) = decode(file);
    assert_eq!(ended.code, Some(1), "a gap is a finding: {}", ended.stderr);
    assert!(ended.stderr.contains("1 connections without telegrams"), "{}", ended.stderr);
    let reply = frame(Dialect::B, b"sRA DeviceIdent \0\x06LMS111\0\x05V1.80").len() as u64;
    let told: Vec<_> = lines
        .iter()
        .map(|line| {
            let kind = line["kind"].as_str().unwrap_or("-");
            let milliseconds = line["time_s"].as_f64().expect("timed") * 1000.0;
            (
                line["from"].as_str().expect("known"),
                kind,
                line["offset"].as_u64().expect("a place"),
                milliseconds.round(),
            )
        })
        .collect();
    let expected = [
        ("host", "sRN", 0, 3.0),
        ("device", "sRA", 0, 4.0),
        ("device", "-", reply, 6.0),
        ("device", "sRA", reply + 40, 6.0),
    ];
    assert_eq!(told, expected);
    assert_eq!(lines[2]["expected"], "40 more bytes");
}

#[test]
fn a_pcap_of_either_byte_order_gives_both_directions() {
    for big in [false, true] {
        let number = |value: u32| if big { value.to_be_bytes() } else { value.to_le_bytes() };
        let mut file: Vec<u8> = [0xA1B2_C3D4, 0x0002_0004, 0, 0, 65535, 1].map(number).concat();
        for (ms, packet) in (0..).zip(conversation()) {
            let len = packet.len() as u32;
            file.extend([1_700_000_000, ms * 1000, len, len].map(number).concat());
            file.extend(packet);
        }
        assert_is_the_conversation(&file);
        let (ended, lines) = decode(&file[..file.len() - 3]);
        assert_eq!(ended.code, Some(1));
        assert_eq!(lines.last().expect("lines")["expected"], "a whole packet");
    }
}

#[test]
fn a_pcapng_counts_time_as_its_interface_says() {
    // Default microseconds; 10^-9 s; 2^-20 s.
    for (resolution, units) in [(None, 1_000_000u64), (Some(9), 1_000_000_000), (Some(0x80 | 20), 1 << 20)] {
        let block = |kind: u32, body: &[u8]| {
            let len = (12 + body.len() as u32).to_le_bytes();
            [&kind.to_le_bytes()[..], &len, body, &len].concat()
        };
        let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
        let mut interface = words(&[1, 0]);
        if let Some(resolution) = resolution {
            interface.extend([9, 0, 1, 0, resolution, 0, 0, 0, 0, 0, 0, 0]);
        }
        let mut file = block(0x0A0D_0D0A, &words(&[0x1A2B_3C4D, 1, u32::MAX, u32::MAX]));
        file.extend(block(1, &interface));
        for (ms, packet) in (0..).zip(conversation()) {
            let time = 1_700_000_000 * units + ms * units / 1000;
            let len = packet.len() as u32;
            let mut body = words(&[0, (time >> 32) as u32, time as u32, len, len]);
            body.extend(&packet);
            body.resize(body.len().next_multiple_of(4), 0);
            file.extend(block(6, &body));
        }
        assert_is_the_conversation(&file);
    }
}

/// Archives of a few hundred kilobytes that unpack to more than any memory: one clear message, and never an abort.
#[test]
fn what_is_larger_than_can_be_decoded_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("large.gz");
    let pack = |piece: &[u8], times: usize| {
        let mut archive = flate2::write::GzEncoder::new(
            std::fs::File::create(&file).expect("made"),
            flate2::Compression::fast(),
        );
        let block = piece.repeat(1 << 12);
        for _ in 0..times >> 12 {
            archive.write_all(&block).expect("packed");
        }
        archive.finish().expect("packed");
    };
    // Bytes of no telegram; telegrams of three bytes; lines of text.
    for (piece, times, says) in [
        (&[0xFF; 64][..], 5 << 20, "more than is decoded at once"),
        (b"\x02s\x03", 1 << 22, "more than is decoded at once"),
        (b"02 73 03\n", 6 << 20, "expected at most 5000000 lines"),
    ] {
        pack(piece, times);
        let ended = run(&["decode", text(&file)]);
        assert_eq!(ended.code, Some(2), "{}", ended.stderr);
        assert!(ended.stderr.contains(says), "{}", ended.stderr);
    }
}

/// Two Compact telegrams, of which the second is damaged where `flip` says so.
fn compact(flip: Option<usize>) -> [Vec<u8>; 2] {
    use rowscan_protocol::compact::{Beams, Module, Modules, PerLine, ScanTelegram, Shape, Telegram};
    let telegram = |telegram_counter: u64| {
        let module = Module {
            segment_counter: 3,
            frame_number: 160,
            shape: Shape { lines: 1, beams: 2, echoes: 1 },
            time_start_us: PerLine(vec![1_000_000]),
            time_stop_us: PerLine(vec![1_005_555]),
            phi_rad: PerLine(vec![0.0]),
            theta_start_rad: PerLine(vec![-0.5]),
            theta_stop_rad: PerLine(vec![0.5]),
            beams: Beams {
                distance: vec![3000, 0],
                rssi: vec![257, 0],
                properties: vec![1, 0],
                theta: vec![1, 2],
            },
            ..Module::default()
        };
        let modules = Modules(vec![module]);
        let scan = ScanTelegram { telegram_counter, modules, ..ScanTelegram::default() }.seal();
        let mut bytes = Vec::new();
        Telegram::Scan(scan).encode(&mut bytes).expect("lists of their lengths");
        bytes
    };
    let mut second = telegram(8);
    if let Some(at) = flip {
        second[at] ^= 1;
    }
    [telegram(7), second]
}

#[test]
fn compact_telegrams_are_told_field_by_field_and_a_flipped_bit_by_their_checksum() {
    let (ended, lines) = decode(&compact(None).concat());
    assert_eq!((ended.code, lines.len()), (Some(0), 2), "{}", ended.stderr);
    for (line, offset, counter) in [(&lines[0], 0, 7), (&lines[1], 122, 8)] {
        assert_eq!(
            (&line["dialect"], &line["name"], &line["from"]),
            (&"Compact".into(), &"scan".into(), &"device".into())
        );
        assert_eq!((&line["offset"], &line["length"]), (&offset.into(), &122.into()));
        let fields = &line["fields"];
        assert_eq!((&fields["telegram_counter"], &fields["version"]), (&counter.into(), &4.into()));
        let module = &fields["modules"][0];
        assert_eq!((&module["frame_number"], &module["time_stop_us"][0]), (&160.into(), &1_005_555.into()));
        assert_eq!(module["beams"]["distance"], serde_json::json!([3000, 0]));
        assert_eq!(module["beams"]["properties"], serde_json::json!([1, 0]));
    }
    assert!(
        lines[0]["words"].as_str().expect("words").contains("time_start_us: [1000000 µs]"),
        "{}",
        lines[0]
    );

    let (ended, lines) = decode(&compact(Some(100)).concat());
    assert_eq!((ended.code, lines.len()), (Some(1), 2));
    assert_eq!((&lines[1]["is"], &lines[1]["error_offset"]), (&"bad".into(), &(122 + 118).into()));
    assert!(lines[1]["expected"].as_str().expect("told").starts_with("CRC "), "{}", lines[1]);
}

#[test]
fn compact_datagrams_of_a_capture_are_told_with_their_times() {
    let mut capture = Vec::new();
    // Raw IP, µs.
    for word in [0xA1B2_C3D4_u32, 0x0004_0002, 0, 0, 65_535, 101] {
        capture.extend(word.to_le_bytes());
    }
    let [first, second] = compact(Some(100));
    // The damaged one is in the middle and takes nothing of the next; a datagram of somebody else is left out.
    for (second_of, payload) in
        [(10_u32, &first), (11, &second), (12, &b"no telegram".to_vec()), (13, &first)]
    {
        let length = (28 + payload.len()) as u16;
        let mut packet = vec![0x45, 0];
        packet.extend(length.to_be_bytes());
        packet.extend([0, 0, 0x40, 0, 64, 17, 0, 0, 192, 168, 0, 1, 192, 168, 0, 100]);
        packet.extend([0x08, 0x43, 0x08, 0x43]);
        packet.extend((length - 20).to_be_bytes());
        packet.extend([0, 0]);
        packet.extend(payload);
        for word in [second_of, 0, packet.len() as u32, packet.len() as u32] {
            capture.extend(word.to_le_bytes());
        }
        capture.extend(packet);
    }
    let (ended, lines) = decode(&capture);
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    let told: Vec<(&Value, Option<f64>)> =
        lines.iter().map(|line| (&line["is"], line["time_s"].as_f64())).collect();
    let (telegram, bad) = (Value::from("telegram"), Value::from("bad"));
    assert_eq!(told, [(&telegram, Some(0.0)), (&bad, Some(1.0)), (&telegram, Some(3.0))]);
}
