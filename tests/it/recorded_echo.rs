//! Which echo the scans of a recording hold, as its conversation tells: to all that read recordings, for all get their scans from one reader.

use crate::common;

use std::io::Cursor;
use std::path::Path;
use std::time::Duration;

use common::binary::run;
use common::replayed::{Packets, write};
use common::talk::Talk;
use rowscan_canopy::Warning;
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_emulator::replay::{Survey, ToldEcho};
use rowscan_protocol::device::{MeasuredEcho, MeasuredLine};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Mount, Rig};
use rowscan_protocol::time::SimTime;
use rowscan_recording::{About, Decoded, McapWriter, Side, StreamKind};
use rowscan_study::reading::{CalibrationChoice, Reading};

const FIRST: Option<EchoChoice> = Some(EchoChoice::First);
const LAST: Option<EchoChoice> = Some(EchoChoice::Last);

/// What an LMS511 and its client say, `scan` being ten scans; and which echo the scans hold.
fn conversations() -> Vec<(Vec<&'static str>, Vec<Option<EchoChoice>>)> {
    let (first, all, last) = ("sWN FREchoFilter 0", "sWN FREchoFilter 1", "sWN FREchoFilter 2");
    vec![
        (vec!["scan"], vec![None]),
        (vec![first, "scan"], vec![FIRST]),
        (vec![all, "scan"], vec![FIRST]),
        (vec![last, "scan"], vec![LAST]),
        (vec![last, first, "scan"], vec![FIRST]),
        // Refused: a code that it does not have.
        (vec![last, "sWN FREchoFilter 7", "scan"], vec![LAST]),
        (vec!["sWN FREchoFilter 7", "scan"], vec![None]),
        (vec![last, "sRN DeviceIdent", "scan", "sRN FREchoFilter", "scan"], vec![LAST, LAST]),
        (vec!["scan", "sRN FREchoFilter", "scan"], vec![None, FIRST]),
        (vec![first, "scan", last, "scan"], vec![FIRST, LAST]),
    ]
}

/// What was said, in a dialect.
fn said(requests: &[&str], dialect: Dialect) -> Packets {
    let mut talk = Talk::with(model::by_name("lms511").expect("known"), dialect);
    for request in requests {
        if *request == "scan" {
            talk.scans(10);
            continue;
        }
        let mut request = request.as_bytes().to_vec();
        if let (Dialect::B, Some(code @ b'0'..=b'9')) = (dialect, request.last_mut()) {
            *code -= b'0';
        }
        talk.ask(&request);
    }
    talk.recorded(0)
}

/// The same as a recording with sides and times, or as the bare bytes of both directions.
fn keep(packets: &Packets, path: &Path, bare: bool) {
    if bare {
        let bytes: Vec<u8> = packets.iter().flat_map(|(.., bytes)| bytes.clone()).collect();
        std::fs::write(path, bytes).expect("kept");
    } else {
        write(path, packets);
    }
}

async fn scanner(path: &Path) -> Scanner {
    let source: Source = path.to_str().expect("text").parse().expect("a file");
    Scanner::open(&source, DriverConfig::default()).await.expect("it opens")
}

fn rig(echo: Option<EchoChoice>) -> Rig {
    let mount = Mount { model: "lms511".into(), echo, ..Mount::default() };
    let optics = Some(BeamWidth::Device);
    Rig {
        optics,
        row_spacing_m: Some(4.0),
        tree_spacing_m: Some(1.0),
        scanners: vec![mount],
        ..Rig::default()
    }
}

/// An estimate's warnings of echoes.
async fn warned(path: &Path, rig: &Rig) -> Vec<&'static str> {
    let reading =
        Reading::of_recording(Some(rig), 0, true, CalibrationChoice::Given(None)).expect("it reads");
    let (mut pipeline, mut scanner) = (reading.pipeline, scanner(path).await);
    while let Some(record) = scanner.next().await.expect("it reads") {
        pipeline.push(record.scan);
    }
    let codes = pipeline.finish().warnings;
    codes
        .iter()
        .map(Warning::code)
        .filter(|code| code.ends_with("_echo") || *code == "echo_unknown")
        .collect()
}

#[tokio::test]
async fn every_scan_of_a_recording_knows_the_echo_that_was_asked_for_before_it() {
    let folder = tempfile::tempdir().expect("a folder");
    for (requests, expected) in conversations() {
        for (dialect, bare) in
            [(Dialect::A, false), (Dialect::B, false), (Dialect::A, true), (Dialect::B, true)]
        {
            let path = folder.path().join("x");
            keep(&said(&requests, dialect), &path, bare);
            let (mut scanner, mut found) = (scanner(&path).await, Vec::new());
            while let Some(record) = scanner.next().await.expect("it reads") {
                found.push(record.scan.echo);
            }
            let case = format!("{requests:?} in {dialect:?}, bare {bare}");
            let expected: Vec<_> = expected.iter().flat_map(|echo| [*echo; 10]).collect();
            assert_eq!(found, expected, "{case}");
        }
    }
}

#[tokio::test]
async fn an_estimate_goes_by_the_echo_that_was_set_and_says_where_the_rig_has_another() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    for (requests, echoes) in conversations() {
        keep(&said(&requests, Dialect::B), &path, false);
        for of_rig in [None, FIRST, LAST] {
            let first = echoes[0];
            // Where some scans hold another echo than the first one does, or than it is believed to, nobody knows which hold which.
            let is_unknown = match first.or(of_rig) {
                None => true,
                Some(believed) => echoes.iter().any(|echo| echo.is_some_and(|echo| echo != believed)),
            };
            let is_other = first.is_some() && of_rig.is_some() && first != of_rig;
            let mut expected = Vec::new();
            expected.extend(is_other.then_some("other_echo"));
            expected.extend(is_unknown.then_some("echo_unknown"));
            assert_eq!(warned(&path, &rig(of_rig)).await, expected, "{requests:?}, the rig has {of_rig:?}");
        }
    }
}

/// The echo is the device's, in whichever stream of the file a client set it: before it came again, or beside the datagrams of the scans.
#[tokio::test]
async fn a_conversation_in_one_stream_tells_the_echo_of_scans_in_another() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    for model in ["lms511", "picoscan150", "multiscan136"] {
        for (code, expected) in [(None, None), (Some(0), FIRST), (Some(2), LAST)] {
            let request = code.map(|code| format!("sWN FREchoFilter {code}"));
            let (talk, scans) = beside(model, request.as_deref());
            let (kind, own) = match model {
                "lms511" => (StreamKind::Cola, "left-2"),
                _ => (StreamKind::Compact, "left-udp"),
            };
            for (name, expected) in [(own, expected), ("right", None)] {
                keep_streams(&path, &[("left", StreamKind::Cola, &talk), (name, kind, &scans)]);
                let case = format!("{model}, {request:?}, scans in `{name}`");
                let source: Source = format!("{}#{name}", path.display()).parse().expect("a stream");
                let mut scanner = Scanner::open(&source, DriverConfig::default()).await.expect("it opens");
                let record = scanner.next().await.expect("it reads").expect("a scan");
                assert_eq!(record.scan.echo, expected, "{case}");

                let survey = Survey::read(&path).expect("it reads");
                let part = survey.parts.iter().find(|part| part.name == name).expect("the stream");
                let told = match expected {
                    None => ToldEcho::Nothing,
                    Some(_) => ToldEcho::Code(code.expect("a code")),
                };
                assert_eq!(part.told_echo(), told, "{case}, played");
            }
        }
    }
}

/// A conversation without scans, and scans of the same device: of the next connection, or as datagrams.
fn beside(model: &str, request: Option<&str>) -> (Packets, Packets) {
    let model = model::by_name(model).or_else(|| model::all().find(|it| it.name == model)).expect("known");
    let mut talk = Talk::with(model, Dialect::A);
    let asked = request.map(|request| talk.ask(request.as_bytes()));
    assert!(asked.is_none_or(|reply| reply.starts_with(b"sWA")));
    if model.compact.is_none() {
        let mut all = talk.recorded(3);
        let scans = all.split_off(all.len() - 3);
        return (all, scans);
    }
    talk.device.direct("127.0.0.1:2115".parse().expect("a place"));
    talk.device.enable_streaming();
    let grid = talk.device.mirror().beams;
    let wall = MeasuredEcho { range_mm: vec![2000; grid.len()], remission: vec![100; grid.len()] };
    let (mut datagrams, mut scans) = (Vec::new(), Packets::new());
    for turn in 0..40_u64 {
        let line = MeasuredLine { grid, echoes: std::slice::from_ref(&wall) };
        let lines = vec![line; model.layers.len().max(1)];
        if talk.device.measure(SimTime(turn * 50_000_000), &lines[0]).is_some() {
            talk.device.segments(SimTime(turn * 50_000_000), &lines, &mut datagrams);
        }
        let sent = datagrams.drain(..).filter_map(|datagram| Some(talk.device.send(datagram)?.1));
        scans.extend(
            sent.map(|bytes| (Duration::from_millis(1000 + 50 * turn), Side::Device, bytes.to_vec())),
        );
    }
    (talk.recorded(0), scans)
}

fn keep_streams(path: &Path, streams: &[(&str, StreamKind, &Packets)]) {
    let mut writer =
        McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).expect("begun");
    for (name, kind, packets) in streams {
        let stream = writer.add_stream(name, *kind).expect("added");
        for (at, from, bytes) in *packets {
            let at_ns = 1_700_000_000_000_000_000 + at.as_nanos() as u64;
            writer.write(stream, *from, at_ns, 0, bytes).expect("written");
        }
    }
    writer.finish().expect("finished");
    std::fs::write(path, writer.into_inner().into_inner()).expect("kept");
}

/// As a user has it: a file, a rig, and nothing said of the echo.
#[test]
fn an_estimate_of_a_file_withholds_nothing_for_an_echo_that_the_file_tells() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, rig) = (folder.path().join("x.mcap"), folder.path().join("rig.toml"));
    let text =
        "version = 2\n[rig]\noptics = \"device\"\nrow_spacing_m = 4.0\n[[rig.scanner]]\nmodel = \"lms511\"\n";
    std::fs::write(&rig, text).expect("kept");
    for (request, unknown) in
        [("sRN DeviceIdent", true), ("sWN FREchoFilter 0", false), ("sWN FREchoFilter 7", true)]
    {
        keep(&said(&[request, "scan", "scan", "scan"], Dialect::A), &path, false);
        let (path, rig) = (path.to_str().expect("text"), rig.to_str().expect("text"));
        let found = run(&["estimate", path, "--rig", rig, "--format", "json"]);
        let told = found.stdout.contains("echo_unknown");
        assert_eq!(told, unknown, "{request}: {} {}", found.stdout, found.stderr);
    }
}
