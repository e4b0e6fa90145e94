//! Two scanners, a receiver and a bus: recorded into one file by one command and played by another, over real sockets and a pseudo-terminal.
#![cfg(target_os = "linux")]

use crate::common;

use std::fs::File;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::thread::JoinHandle;

use common::binary::{Emulator, assert_says, finish, listening, refused, run};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::telegram::Kind;
use rowscan_recording::{FrameReader, Recording, Side, StreamKind};
use serde_json::Value;

/// A quick scene.
const SCENE: &str = "version = 1\n[orchard]\ntrees = 2\n[orchard.tree]\niterations = 7\n";
/// A bus of this test's own.
const BUS: &str = "udp:239.74.163.21:43921";

/// What a stream sent unasked, packet by packet.
fn sent(path: &Path, stream: &str) -> Vec<Vec<u8>> {
    let mut frames = FrameReader::new(Recording::open(path).expect("it opens"));
    let mut sent = Vec::new();
    while let Some(frame) = frames.next_frame().expect("it reads") {
        let scans = |kind| kind == StreamKind::Cola;
        let unasked =
            !scans(frame.kind) || frame.telegram().is_some_and(|telegram| telegram.kind == Kind::Sn);
        let name = frames.recording().streams()[frame.stream].name.clone();
        if name == stream && frame.from == Side::Device && unasked {
            sent.push(frame.bytes);
        }
    }
    sent
}

/// Reads to the end in a thread of its own. A pseudo-terminal ends with an error.
fn drain(mut input: impl Read + Send + 'static) -> JoinHandle<Vec<u8>> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = input.read_to_end(&mut bytes);
        bytes
    })
}

fn subscribe(address: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).expect("it listens");
    let mut frame = Vec::new();
    encode(Dialect::B, b"sEN LMDscandata \x01", &mut frame);
    stream.write_all(&frame).expect("taken");
    stream
}

#[test]
fn four_streams_of_one_machine_go_through_one_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (row, run_file, again) = (file("row.toml"), file("run.mcap"), file("again.mcap"));
    std::fs::write(&row, SCENE).expect("written");

    let tractor = ["--tcp", "127.0.0.1:0", "--nmea", "tcp:127.0.0.1:0", "--can", BUS, &row];
    let (child, endpoints) = listening("emulate", &tractor, 3);
    let of = |name: &str| endpoints.iter().find(|endpoint| endpoint["endpoint"] == name).expect("announced");
    let address = |name: &str| of(name)["address"].as_str().expect("an address").to_owned();
    let (nmea, left) = (format!("tcp:{}", address("nmea")), format!("left=tcp://{}", address("tcp")));
    let _left = Emulator { child, address: address("tcp") };
    let right = Emulator::start(&[&row, "--model", "lms511"]);
    let right_url = format!("right={}", right.url());
    let ended =
        run(&["record", &left, &right_url, "--nmea", &nmea, "--can", BUS, "-o", &run_file, "--scans", "40"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let info = run(&["record", "--info", &run_file, "--format", "json"]);
    let info: Value = serde_json::from_str(&info.stdout).expect("json");
    let kinds: Vec<(&str, &str)> = info["streams"]
        .as_array()
        .expect("listed")
        .iter()
        .map(|stream| (stream["stream"].as_str().expect("named"), stream["kind"].as_str().expect("told")))
        .collect();
    for expected in [("left", "cola"), ("right", "cola"), ("gnss", "nmea"), ("can", "can")] {
        assert!(kinds.contains(&expected), "{kinds:?}");
    }

    // Out again: a scanner each over TCP, sentences on a pseudo-terminal, the bus as a log.
    let (pty, log) = (file("gps"), file("bus.log"));
    let (nmea, can) = (format!("pty:{pty}"), format!("candump:{log}"));
    let (replay, endpoints) = listening(
        "replay",
        &[
            &run_file,
            "--tcp",
            "right=127.0.0.1:0",
            "--tcp",
            "left=127.0.0.1:0",
            "--nmea",
            &nmea,
            "--can",
            &can,
            "--record",
            &again,
            "--decoded",
            "none",
        ],
        4,
    );
    let address = |stream: &str| {
        let found = endpoints.iter().find(|endpoint| endpoint["stream"] == stream).expect("announced");
        found["address"].as_str().expect("an address").to_owned()
    };
    let sentences = drain(File::open(&pty).expect("it is there"));
    let left = drain(subscribe(&address("left")));
    let right = drain(subscribe(&address("right")));
    let ended = finish(replay);
    assert_eq!(ended.code, Some(0));

    let recorded = |stream: &str| sent(Path::new(&run_file), stream);
    for (stream, received) in [("left", left), ("right", right)] {
        let (scans, received) = (recorded(stream), received.join().expect("read"));
        assert!(scans.len() >= 40, "{stream}: {} scans", scans.len());
        assert!(received.ends_with(&scans.concat()), "{stream}: other scans than recorded");
        assert_eq!(sent(Path::new(&again), stream), scans, "{stream}, recorded again");
    }
    // What was said before the first scan is passed over.
    let (gnss, received) = (recorded("gnss").concat(), sentences.join().expect("read"));
    assert!(received.len() > 5 * 200, "{} bytes of sentences", received.len());
    assert!(gnss.ends_with(&received), "other sentences than recorded");
    let log = std::fs::read_to_string(&log).expect("kept");
    let frames: Vec<Vec<u8>> = log
        .lines()
        .filter_map(|line| line.split(' ').nth(2))
        .map(|frame| frame.as_bytes().to_vec())
        .collect();
    assert!(frames.len() > 30, "{} frames", frames.len());
    assert!(recorded("can").ends_with(&frames), "other frames than recorded");

    // Half of it is a finding, with the way out; what comes before the cut is there.
    let half = std::fs::read(&run_file).expect("there");
    std::fs::write(file("half.mcap"), &half[..half.len() / 2]).expect("written");
    let ended = run(&["record", "--info", &file("half.mcap"), "--format", "json"]);
    assert_eq!(ended.code, Some(1));
    assert_says(&ended.stderr, &["half.mcap: broken off at byte", "expected a whole record", "--repair"]);
    let info: Value = serde_json::from_str(&ended.stdout).expect("json");
    let scans = |stream: &Value| stream["scans"].as_u64().expect("counted");
    assert!(info["streams"].as_array().expect("listed").iter().map(scans).sum::<u64>() > 5);
}

#[test]
fn a_stream_is_refused_a_place_that_cannot_carry_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("bus.log").to_str().expect("UTF-8").to_owned();
    std::fs::write(&log, "(1700000000.000001) can0 18FEF100#0102\n").expect("written");
    for (places, parts) in [
        (&["--tcp", "left=127.0.0.1:0"][..], &["no stream `left`", "it has can0 (can)"][..]),
        (
            &["--nmea", "can0=tcp:127.0.0.1:0"],
            &["stream `can0` is can", "--nmea cannot carry", "expected --can"],
        ),
        (&["--nmea", "tcp:127.0.0.1:0"], &["stream `can0` is can", "--nmea cannot carry", "expected --can"]),
        (
            &["--tcp", "can0=127.0.0.1:0", "--can", "can0=udp:239.74.163.22:43922"],
            &["`can0` cannot go out on --tcp and --can at once"],
        ),
        (&[], &["stream `can0` is can", "expected --can"]),
    ] {
        assert_says(&refused(&[&["replay", &log], places].concat()), parts);
    }
    let missing = folder.path().join("no.mcap").to_str().expect("UTF-8").to_owned();
    for (sources, parts) in [
        (["--nmea", "tcp:127.0.0.1:1"], &["cannot open NMEA at 127.0.0.1:1", "refused"][..]),
        (["--nmea", "gps"], &["expected a receiver as HOST:PORT or tcp:HOST:PORT", "found `gps`"]),
        (["--can", "socketcan:nocan9"], &["no CAN carrier on `nocan9`"]),
        (["--nmea", "serial:/dev/nothing@4800"], &["/dev/nothing"]),
    ] {
        assert_says(&refused(&[&["record", "-o", &missing][..], &sources].concat()), parts);
    }
    assert!(!Path::new(&missing).exists(), "nothing is written before all is there");
}
