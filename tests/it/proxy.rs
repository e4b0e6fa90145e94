//! The proxy between a scanner and its client, and the driver as the system under test behind it.

use std::fs;
use std::path::PathBuf;

use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::random::{Rng, Stream};
use serde_json::Value;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

use crate::common::binary::{Emulator, Telling, assert_says, refused, run, text};

/// A file of faults in a folder of its own.
fn file(content: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("faults.toml");
    fs::write(&path, content).expect("written");
    (folder, path)
}

const SCENE: [&str; 2] = ["--model", "lms111"];

/// Random bytes, with many that look like the start of a telegram.
fn noise(seed: u64, len: usize) -> Vec<u8> {
    let mut random = Stream::keyed(seed, &[1]);
    (0..len).map(|_| if random.unit() < 0.3 { 0x02 } else { random.next_u32() as u8 }).collect()
}

/// Writes `bytes` in chunks of any size.
async fn pour(mut to: impl AsyncWriteExt + Unpin, bytes: &[u8]) {
    let mut random = Stream::keyed(9, &[1]);
    let mut rest = bytes;
    while !rest.is_empty() {
        let (chunk, left) = rest.split_at((1 + (random.unit() * 5000.0) as usize).min(rest.len()));
        to.write_all(chunk).await.expect("open");
        rest = left;
    }
    to.shutdown().await.expect("open");
}

/// What is not asked for does not happen: not a byte is changed, lost or added, either way, and an end is handed on as an end.
#[tokio::test]
async fn every_byte_passes_both_ways_while_no_fault_is_active() {
    let (_folder, later) = file(
        "[[fault]]\nname = \"drop\"\nat = { s = 86400 }\n[[fault]]\nname = \"flip\"\nat = { scan = 100 }\n",
    );
    for faults in [None, Some(&later)] {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let source = format!("tcp://{}", listener.local_addr().expect("bound"));
        let mut arguments = vec![source.as_str(), "--tcp", "127.0.0.1:0"];
        if let Some(path) = faults {
            arguments.extend(["--faults", text(path)]);
        }
        let mut proxy = Telling::start("proxy", &arguments);
        let client = TcpStream::connect(proxy.address()).await.expect("it listens");
        let (device, _) = listener.accept().await.expect("it dials");
        let (from_device, from_client) = (noise(1, 4_000_000), noise(2, 500_000));
        let (mut client_reads, client_writes) = client.into_split();
        let (mut device_reads, device_writes) = device.into_split();
        let (mut at_client, mut at_device) = (Vec::new(), Vec::new());
        let (_, _, to_client, to_device) = tokio::join!(
            pour(device_writes, &from_device),
            pour(client_writes, &from_client),
            client_reads.read_to_end(&mut at_client),
            device_reads.read_to_end(&mut at_device),
        );
        assert_eq!((to_client.expect("an end"), to_device.expect("an end")), (4_000_000, 500_000));
        assert!(at_client == from_device && at_device == from_client, "the bytes are others");
        assert_eq!(proxy.next().expect("told")["event"], "connected");
        let gone = proxy.next().expect("told");
        assert_eq!((&gone["event"], &gone["to_client_bytes"]), (&"disconnected".into(), &4_000_000.into()));
        let end = proxy.end();
        let [end] = end.as_slice() else { panic!("{end:?}") };
        assert_eq!((&end["event"], &end["connections"]), (&"end".into(), &1.into()));
        assert_eq!((&end["to_device_bytes"], &end["faults_begun"]), (&500_000.into(), &0.into()));
    }
}

/// A connection that is open when the proxy ends is told and counted before the end is, which is the last line.
#[tokio::test]
async fn what_is_open_at_the_end_is_told_and_counted() {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let source = format!("tcp://{}", listener.local_addr().expect("bound"));
    let mut proxy = Telling::start("proxy", &[&source, "--tcp", "127.0.0.1:0"]);
    let address = proxy.address();
    let mut open = Vec::new();
    for _ in 0..20 {
        let mut client = TcpStream::connect(&address).await.expect("it listens");
        let (mut device, _) = listener.accept().await.expect("it dials");
        client.write_all(b"to the device").await.expect("open");
        device.write_all(b"to it").await.expect("open");
        device.read_exact(&mut [0; 13]).await.expect("open");
        client.read_exact(&mut [0; 5]).await.expect("open");
        open.push((client, device));
    }
    let told = proxy.end();
    let cut = told.iter().filter(|line| line["event"] == "disconnected");
    let cut: Vec<_> = cut
        .map(|line| {
            (line["to_client_bytes"].clone(), line["to_device_bytes"].clone(), line["reason"].clone())
        })
        .collect();
    assert_eq!(cut, vec![(5.into(), 13.into(), "the proxy ended".into()); 20], "{told:?}");
    let end = told.last().expect("an end");
    assert_eq!((&end["event"], &end["connections"]), (&"end".into(), &20.into()), "{told:?}");
    assert_eq!((&end["to_client_bytes"], &end["to_device_bytes"]), (&100.into(), &260.into()));
}

/// Our driver as the system under test: exact loss, and one reconnect.
#[tokio::test]
async fn the_driver_loses_exactly_what_was_dropped_and_redials_after_a_reset() {
    let (_folder, faults) = file(
        "[[fault]]\nname = \"drop\"\ntelegrams = 3\nat = { scan = 10 }\n\
         [[fault]]\nname = \"checksum\"\nat = { scan = 20 }\n\
         [[fault]]\nname = \"duplicate\"\nat = { scan = 30 }\n\
         [[fault]]\nname = \"rst\"\nat = { scan = 40 }\n",
    );
    let emulator = Emulator::start(&SCENE);
    let arguments = [&emulator.url(), "--tcp", "127.0.0.1:0", "--faults", text(&faults)];
    let mut proxy = Telling::start("proxy", &arguments);
    let source: Source = format!("tcp://{}", proxy.address()).parse().expect("a source");
    let mut scanner = Scanner::open(&source, DriverConfig::default()).await.expect("it streams");
    let mut counters = Vec::new();
    while scanner.counts().connections < 2 || counters.len() < 60 {
        let record = scanner.next().await.expect("it is kept").expect("it is live");
        counters.push(record.scan.telegram_counter);
    }
    let gaps: Vec<u16> = counters.windows(2).map(|pair| pair[1].wrapping_sub(pair[0])).collect();
    // Up to the reset: one gap of three, one of one, one repeat. The device may leave turns out itself, and counts those not.
    let before: Vec<_> = gaps.iter().take(35).filter(|gap| **gap != 1).collect();
    assert_eq!(before, [&4, &2, &0], "{counters:?}");
    let counts = scanner.counts();
    assert_eq!((counts.connections, counts.telegrams_bad), (2, 1));
    drop(scanner);
    let told = proxy.end();
    let begun: Vec<&Value> =
        told.iter().filter(|line| line["what"] == "begin").map(|line| &line["id"]).collect();
    assert_eq!(begun, ["drop", "checksum", "duplicate", "rst"]);
    assert_eq!(told.last().expect("an end")["connections"], 2);
}

/// What is recorded is what went over the client's wire.
#[test]
fn the_recording_holds_what_the_client_got() {
    let (folder, faults) = file("[[fault]]\nname = \"drop\"\ntelegrams = 2\nat = { scan = 5 }\n");
    let recording = folder.path().join("run.mcap");
    let emulator = Emulator::start(&SCENE);
    let arguments =
        [&emulator.url(), "--tcp", "127.0.0.1:0", "--faults", text(&faults), "--record", text(&recording)];
    let mut proxy = Telling::start("proxy", &arguments);
    let source = format!("tcp://{}", proxy.address());
    let other = folder.path().join("client.mcap");
    let ended = run(&["record", &source, "-o", text(&other), "--scans", "20"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    proxy.end();
    for path in [&recording, &other] {
        let info = run(&["record", "--info", text(path), "--format", "json"]);
        let info: Value = serde_json::from_str(&info.stdout).expect("json");
        assert_eq!(info["streams"][0]["scans_lost"], 2, "{}: {info}", path.display());
    }
}

/// A serial scanner behind a serial proxy: the rate the client sets is handed on.
#[cfg(target_os = "linux")]
#[test]
fn a_serial_line_is_found_raised_and_read_through_the_proxy() {
    let folder = tempfile::tempdir().expect("a folder");
    let (there, here) = (folder.path().join("scanner"), folder.path().join("proxy"));
    let mut emulator = Telling::start("emulate", &["--model", "lms291", "--pty", text(&there)]);
    emulator.address();
    let source = format!("serial:{}", there.display());
    let mut proxy = Telling::start("proxy", &[&source, "--pty", text(&here)]);
    proxy.address();
    let (source, out) = (format!("serial:{}", here.display()), folder.path().join("run.mcap"));
    let ended = run(&["record", &source, "-o", text(&out), "--scans", "5"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let info = run(&["record", "--info", text(&out), "--format", "json"]);
    let info: Value = serde_json::from_str(&info.stdout).expect("json");
    assert!(info["streams"][0]["scans"].as_u64() >= Some(5), "{info}");
}

#[test]
fn what_a_proxy_cannot_do_is_refused_with_the_remedy() {
    let (_folder, faults) = file("\n[[fault]]\nname = \"flip\"\nat = { row_m = 3 }\n");
    let proxy =
        |more: &[&str]| refused(&[&["proxy", "tcp://127.0.0.1:1", "--tcp", "127.0.0.1:0"], more].concat());
    assert_says(
        &proxy(&["--faults", text(&faults)]),
        &["fault `flip`: `row_m` and `tree` need a row, and there is none here; use `s`, `scan` or `after`"],
    );
    fs::write(&faults, "\n[[fault]]\nname = \"flipp\"\n").expect("written");
    assert_says(
        &proxy(&["--faults", text(&faults)]),
        &["faults.toml:3: unknown fault `flipp`; did you mean `flip`?"],
    );
    fs::write(&faults, "[[fault]]\nname = \"flip\"\non = \"left\"\n").expect("written");
    assert_says(&proxy(&["--faults", text(&faults)]), &["there is no stream `left`; valid here: scanner0"]);
    assert_says(
        &refused(&["proxy", "run.mcap", "--tcp", "127.0.0.1:0"]),
        &["is a recording", "rowscan replay run.mcap --faults FILE"],
    );
    assert_says(&proxy(&["--faults", "none.toml"]), &["cannot read none.toml"]);
}
