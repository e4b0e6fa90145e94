//! Files that do not say when their scans were made, replayed: every scan comes, at the rate of its mode.

use crate::common;

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use common::binary::{Ended, assert_says, finish, listening, rowscan};
use common::recorded::folder;
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::lms2xx::frame::{FROM_DEVICE, encode_with};
use rowscan_protocol::lms2xx::values::{CountWord, Output, Unit, Values};
use rowscan_recording::{About, Decoded, McapWriter, Side, StreamKind};

/// Operating modes of an LMS2xx (telegram listing, 20): 500 000 bits a second, and a stream of all values.
const FAST: [u8; 8] = [0x02, 0x00, 0x02, 0x00, 0x20, 0x48, 0x58, 0x08];
const STREAM: [u8; 8] = [0x02, 0x00, 0x02, 0x00, 0x20, 0x24, 0x34, 0x08];

/// A scan of 361 values half a degree apart, as firmware without an index sends it.
fn lms2xx_scan(number: u16) -> Vec<u8> {
    let values = Values {
        output: Output::All,
        word: CountWord { count: 361, partial: None, unit: Some(Unit::Mm) },
        values: vec![1000 + number; 361],
        status: 0x10,
        ..Values::default()
    };
    let mut bytes = Vec::new();
    encode_with(FROM_DEVICE, &mut bytes, |out| values.encode(out));
    bytes
}

/// A scan of an LMS111 at 50 Hz whose clock stands still.
fn cola_scan(number: u16) -> Vec<u8> {
    let body = format!(
        "sSN LMDscandata 1 1 16F4C7A 0 0 {number:X} {number:X} 5 9 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 \
         0 0 0 0"
    );
    let mut bytes = Vec::new();
    encode(Dialect::A, body.as_bytes(), &mut bytes);
    bytes
}

/// Replays a file to a client that says `hello` and reads to the end; what it read, how long that took, and how the replay ended.
fn replay(file: &str, hello: &[&[u8]], more: &[&str]) -> (Vec<u8>, Duration, Ended) {
    let mut command = rowscan();
    command.args(["replay", file, "--format", "jsonl", "--tcp", "127.0.0.1:0"]).args(more);
    command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped());
    let mut child = command.spawn().expect("the binary runs");
    let mut out = std::io::BufReader::new(child.stdout.take().expect("piped"));
    let mut line = String::new();
    std::io::BufRead::read_line(&mut out, &mut line).expect("it listens");
    let line: serde_json::Value = serde_json::from_str(&line).expect("json");
    let mut client = TcpStream::connect(line["address"].as_str().expect("an address")).expect("it listens");
    let began = Instant::now();
    for request in hello {
        client.write_all(request).expect("taken");
        std::thread::sleep(Duration::from_millis(100));
    }
    let mut bytes = Vec::new();
    client.read_to_end(&mut bytes).expect("read");
    let took = began.elapsed();
    let mut rest = String::new();
    out.read_to_string(&mut rest).expect("text");
    (bytes, took, finish(child))
}

fn count(bytes: &[u8], head: &[u8]) -> usize {
    bytes.windows(head.len()).filter(|window| *window == head).count()
}

const LMS2XX_HEAD: [u8; 7] = [0x02, 0x80, 0xD6, 0x02, 0xB0, 0x69, 0x41];

#[test]
fn a_raw_lms2xx_log_without_times_plays_all_its_scans() {
    let (_folder, file) = folder();
    std::fs::write(file("log.bin"), (0..100).flat_map(lms2xx_scan).collect::<Vec<u8>>()).expect("written");
    let (bytes, took, ended) = replay(&file("log.bin"), &[&FAST, &STREAM], &[]);
    assert_eq!(count(&bytes, &LMS2XX_HEAD), 100, "{}", ended.stderr);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_says(&ended.stderr, &["nothing in the file tells when", "37.50 scans a second"]);
    // Two mirror turns of 1/75 s each.
    assert!(took > Duration::from_millis(99 * 26), "{took:?}");
}

/// At 9600 a scan of 361 values takes 763 ms: the line sets the pace, and nothing is dropped for it.
#[test]
fn a_slow_line_is_waited_for_where_times_are_assumed() {
    let (_folder, file) = folder();
    std::fs::write(file("log.bin"), (0..22).flat_map(lms2xx_scan).collect::<Vec<u8>>()).expect("written");
    let (bytes, _, ended) = replay(&file("log.bin"), &[&STREAM], &["--time-scale", "10"]);
    assert_eq!((count(&bytes, &LMS2XX_HEAD), ended.code), (22, Some(0)), "{}", ended.stderr);
}

#[test]
fn a_cola_log_whose_clock_stands_still_plays_all_its_scans() {
    let (_folder, file) = folder();
    std::fs::write(file("log.bin"), (0..100).flat_map(cola_scan).collect::<Vec<u8>>()).expect("written");
    let hello: &[&[u8]] = &[b"\x02sEN LMDscandata 1\x03"];
    let (bytes, took, ended) = replay(&file("log.bin"), hello, &["--model", "lms111"]);
    assert_eq!(count(&bytes, b"sSN LMDscandata "), 100, "{}", ended.stderr);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_says(&ended.stderr, &["nothing in the file tells when", "50.00 scans a second"]);
    assert!(took > Duration::from_millis(1900), "{took:?}");
}

/// The host's clock, too.
#[test]
fn a_recording_whose_clock_stands_still_plays_all_its_scans() {
    let (_folder, file) = folder();
    std::fs::write(file("log.mcap"), recorded(StreamKind::Cola, 60, 0, cola_scan)).expect("written");
    let hello: &[&[u8]] = &[b"\x02sEN LMDscandata 1\x03"];
    let (bytes, took, ended) = replay(&file("log.mcap"), hello, &["--model", "lms111"]);
    assert_eq!((count(&bytes, b"sSN LMDscandata "), ended.code), (60, Some(0)), "{}", ended.stderr);
    assert!(took > Duration::from_millis(1100), "{took:?}");
}

/// So many scans, `every_ms` apart by the host's clock.
fn recorded(kind: StreamKind, scans: u16, every_ms: u64, scan: fn(u16) -> Vec<u8>) -> Vec<u8> {
    let out = std::io::Cursor::new(Vec::new());
    let mut writer = McapWriter::new(out, &About::default(), Decoded::default()).expect("begun");
    let stream = writer.add_stream("scanner", kind).expect("added");
    for number in 0..scans {
        let at_ns = (1_700_000_000_000 + u64::from(number) * every_ms) * 1_000_000;
        writer.write(stream, Side::Device, at_ns, 0, &scan(number)).expect("written");
    }
    writer.finish().expect("finished");
    writer.into_inner().into_inner()
}

#[test]
fn a_replay_that_drops_scans_says_so_and_ends_with_1() {
    let (_folder, file) = folder();
    // 40 scans a second on a line that carries one in 763 ms.
    std::fs::write(file("fast.mcap"), recorded(StreamKind::Lms2xx, 60, 25, lms2xx_scan)).expect("written");
    let (bytes, _, ended) = replay(&file("fast.mcap"), &[&STREAM], &["--time-scale", "5"]);
    let sent = count(&bytes, &LMS2XX_HEAD);
    assert!((1..60).contains(&sent), "{sent} sent");
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert_says(&ended.stderr, &["recorded scans did not reach their clients", "--time-scale max"]);
    let (bytes, _, ended) = replay(&file("fast.mcap"), &[&STREAM], &["--time-scale", "max"]);
    assert_eq!((count(&bytes, &LMS2XX_HEAD), ended.code), (60, Some(0)), "{}", ended.stderr);
}

#[test]
fn a_verbatim_replay_needs_no_model_and_takes_any() {
    let (_folder, file) = folder();
    std::fs::write(file("log.mcap"), recorded(StreamKind::Lms2xx, 3, 20, lms2xx_scan)).expect("written");
    for model in ["lms200", "lms291", "lms111"] {
        let (bytes, _, ended) = replay(&file("log.mcap"), &[], &["--verbatim", "--model", model]);
        assert_eq!((count(&bytes, &LMS2XX_HEAD), ended.code), (3, Some(0)), "{model}: {}", ended.stderr);
    }
}

/// As a public log has it: the type text of a real LMS200, whose key SICK's listing does not have.
#[test]
fn a_real_lms200_is_replayed_by_its_name() {
    let (_folder, file) = folder();
    let mut named = vec![0x06];
    encode_with(FROM_DEVICE, &mut named, |out| {
        out.extend_from_slice(b"\xBALMS200;S18063;V02.19 \x10");
    });
    named.extend((0..3).flat_map(lms2xx_scan));
    std::fs::write(file("log.bin"), named).expect("written");
    let (child, _) = listening("replay", &[&file("log.bin"), "--tcp", "127.0.0.1:0"], 1);
    common::binary::interrupt(&child);
    let ended = finish(child);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
}
