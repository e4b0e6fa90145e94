//! Left and right scanner of one tractor in one process.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

use crate::common;

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use common::binary::{Emulator, assert_says, listening, refused, rowscan, run};
use rowscan_recording::{Decoded, McapWriter, Recording};
use serde_json::Value;

const SCENE: &str = r#"
version = 1
[orchard]
preset = "spindle"
trees = 3
rows = 2
[orchard.tree]
iterations = 6
[drive]
alley = 1
[[rig.scanner]]
model = "lms111"
distance_m = 2.0
row = "right"
[[rig.scanner]]
model = "tim561"
distance_m = 2.0
row = "left"
"#;

#[test]
fn each_scanner_has_its_own_port_and_sees_its_own_row() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("two.toml");
    std::fs::write(&scene, SCENE).unwrap();
    let scene = scene.to_str().unwrap();
    let mut emulate = rowscan();
    emulate.args(["emulate", scene, "--scanner", "0", "--scanner", "1", "--format", "jsonl"]);
    let recording = folder.path().join("both.mcap");
    let recording = recording.to_str().unwrap();
    emulate.args(["--tcp", "127.0.0.1:0", "--tcp", "127.0.0.1:0", "--record", recording]);
    let child = emulate.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary runs");
    let mut emulator = Emulator { child, address: String::new() };
    let mut lines = BufReader::new(emulator.child.stdout.take().unwrap()).lines();
    let mut place = |scanner: u64| {
        let stream = format!("scanner{scanner}");
        let line: Value = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
        assert_eq!(
            (&line["event"], line["stream"].as_str()),
            (&Value::from("listening"), Some(stream.as_str()))
        );
        line["address"].as_str().unwrap().to_owned()
    };
    let sources = [place(0), place(1)].map(|place| format!("tcp://{place}"));
    let mut said = BufReader::new(emulator.child.stderr.take().unwrap()).lines().map(|line| line.unwrap());
    let hint = said.find_map(|line| line.strip_prefix("estimate with: rowscan ").map(str::to_owned)).unwrap();
    assert_eq!(hint, format!("estimate {} --rig {scene}", sources.join(" ")));
    let log = folder.path().join("canopy.log");
    let bus = format!("candump:{}", log.to_str().unwrap());
    let flags = ["--scans", "60", "--format", "json", "--can", &bus];
    let ended = run(&[hint.split(' ').collect(), flags.to_vec()].concat());
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    // The line that says where the bus is stands on standard error.
    let found: Value = serde_json::from_str(&ended.stdout).unwrap();
    let [right, left] = found["scanners"].as_array().unwrap().as_slice() else { panic!("{found}") };
    for (number, (estimate, source)) in [right, left].into_iter().zip(&sources).enumerate() {
        assert_eq!((&estimate["scanner"], &estimate["source"]), (&number.into(), &source.as_str().into()));
        assert!(ended.stderr.contains(&format!("scanner{number}: connected")), "{}", ended.stderr);
    }
    assert_eq!((&right["points_per_scan"], &left["points_per_scan"]), (&541.into(), &811.into()));
    // An LMS111 turns fifty times a second, a TiM561 fifteen times: the same tractor goes farther between its lines.
    for (estimate, hertz) in [(right, 50.0), (left, 15.0)] {
        assert_eq!(estimate["scans"], 60);
        let advance_m = estimate["advance_m"].as_f64().unwrap();
        // A host that is held up misses some.
        let turns = 59.0 + estimate["scans_lost"].as_f64().unwrap();
        assert!((advance_m - turns / hertz).abs() < 2.5 / hertz, "{advance_m} m at {hertz} Hz");
        assert!(estimate["impacted_total_area_m2"].as_f64().unwrap() > 0.05, "{estimate}");
    }
    // Each of them has a control function of its own on the bus: the right one for 1.2 s, the left one for 4.
    let frames = std::fs::read_to_string(log).unwrap();
    for (summary, seconds) in [(" 10FF1080#", 1.2), (" 10FF1081#", 4.0)] {
        let heard = frames.lines().filter(|line| line.contains(summary)).count() as f64;
        assert!((6.0 * seconds..=10.0 * seconds + 2.0).contains(&heard), "{heard} of{summary}");
    }
    emulator.end();
    let recorded = ["scanner0", "scanner1"].map(|stream| format!("{recording}#{stream}"));
    let rows = |format: &str, by: &str| {
        let sources = ["estimate", &recorded[0], &recorded[1]];
        let asked = ["--rig", scene, "--scans", "60", "--format", format, "--by", by];
        let ended = run(&[&sources[..], &asked].concat());
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        ended.stdout
    };
    let lines = rows("jsonl", "row");
    let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let areas = |of: [&Value; 2]| of.map(|estimate| estimate["impacted_total_area_m2"].as_f64().unwrap());
    assert_eq!(
        areas([&lines[0], &lines[1]]),
        areas([right, left]),
        "the recording's areas are the live ones"
    );
    // Somebody who is connected to and never answers.
    let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let silent_at = format!("tcp://{}", silent.local_addr().unwrap());
    let ended = run(&["estimate", &recorded[0], &silent_at, "--rig", scene, "--format", "jsonl"]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert_says(&ended.stderr, &[silent_at.trim_start_matches("tcp://")]);
    drop(silent);
    let seen: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert!(seen["scans"].as_u64() >= Some(60), "what the other one saw is not lost: {seen}");
    let ended = run(&["estimate", &recorded[0], "--rig", scene, "--can", "candump:/dev/full"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_says(&ended.stderr, &["the log ends here", "No space left", "/dev/full"]);
    let csv = rows("csv", "row");
    assert!(csv.starts_with("scanner,source,") && csv.lines().count() == 3, "{csv}");
    let csv = rows("csv", "tree");
    assert!(csv.starts_with("scanner,tree,") && csv.contains("\n1,0,"), "{csv}");
}

#[test]
fn sources_and_scanners_must_go_together() {
    let two = ["estimate", "tcp://127.0.0.1:1", "tcp://127.0.0.1:2", "--rig", "spindle"];
    for (flags, remedy) in [
        (&["--scanner", "0"][..], "expected one --scanner for each of the 2 sources"),
        (&[], "there is no scanner 1"),
        (&["--scanner", "0", "--scanner", "0"], "cannot connect"),
    ] {
        assert_says(&refused(&[&two, flags].concat()), &[remedy]);
    }
}

#[test]
fn what_several_scanners_cannot_share_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let two = folder.path().join("two.toml");
    let scanner = "[[rig.scanner]]\nmodel = \"lms111\"\n";
    let quick = "version = 1\n[orchard]\ntrees = 1\n[orchard.tree]\niterations = 7\n";
    std::fs::write(&two, format!("{quick}{scanner}{scanner}")).expect("written");
    let two = two.to_str().expect("UTF-8");
    for (scene, flags, remedy) in [
        (two, &["--pty", "line"][..], "are one scanner's"),
        (two, &["--tcp", "127.0.0.1:0"], "one --tcp for each of the 2 scanners"),
        (two, &["--state", "settings.txt"], "give one --scanner"),
        (
            "spindle",
            &["--tcp", "127.0.0.1:0", "--tcp", "127.0.0.1:0"],
            "there is no scanner 1: expected a number below 1",
        ),
    ] {
        let ended = run(&[&["emulate", scene, "--scanner", "0", "--scanner", "1"], flags].concat());
        assert_eq!(ended.code, Some(2), "{flags:?}");
        assert!(ended.stderr.contains(remedy), "{flags:?}: {}", ended.stderr);
    }
}

#[test]
fn two_scanners_of_one_mount_have_names_of_their_own() {
    let args = ["post", "--scanner", "0", "--scanner", "0", "--tcp", "127.0.0.1:0", "--tcp", "127.0.0.1:0"];
    let (mut child, places) = listening("emulate", &args, 2);
    child.kill().expect("it serves");
    child.wait().expect("it has ended");
    let streams: Vec<_> = places.iter().map(|place| place["stream"].as_str()).collect();
    assert_eq!(streams, [Some("scanner0"), Some("scanner0-2")]);
}

/// A rig that goes by what its scanners' models are: their beams widen.
const BY_MODEL: &str = r#"
version = 2
[rig]
tree_spacing_m = 1.5
row_spacing_m = 4.0
optics = "device"
[[rig.scanner]]
model = "lms111"
distance_m = 2.0
row = "right"
[[rig.scanner]]
model = "picoscan150"
distance_m = 2.0
row = "left"
"#;

/// The same recording; of its models each one is told of the other's streams.
fn with_models_swapped(from: &std::path::Path, to: &std::path::Path) {
    let mut recording = Recording::open(from).expect("it opens");
    let mut packets = Vec::new();
    while let Some(packet) = recording.next_packet().expect("it reads") {
        packets.push(packet);
    }
    let mut about = recording.about().clone();
    for model in about.models.values_mut() {
        *model = if model == "lms111" { "picoscan150" } else { "lms111" }.to_owned();
    }
    let mut writer =
        McapWriter::new(std::io::Cursor::new(Vec::new()), &about, Decoded::default()).expect("begun");
    let add =
        |stream: &rowscan_recording::StreamInfo| writer.add_stream(&stream.name, stream.kind).expect("added");
    let streams: Vec<_> = recording.streams().iter().map(add).collect();
    for packet in packets {
        let (side, at_ns) = (packet.from.expect("a side"), packet.at_ns.expect("a time"));
        writer.write(streams[packet.stream], side, at_ns, 0, &packet.bytes).expect("written");
    }
    writer.finish().expect("finished");
    std::fs::write(to, writer.into_inner().into_inner()).expect("kept");
}

#[test]
fn each_stream_of_a_recording_is_read_by_its_own_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let [scene, right, wrong, file, twin] =
        ["scene.toml", "right.toml", "wrong.toml", "both.mcap", "twin.mcap"].map(path);
    // Beams that widen, as the rigs say: an emulator's recording knows which it had.
    let emulated = SCENE.replace("tim561", "picoscan150") + "[optics]\nstages = \"device\"\n";
    std::fs::write(&scene, emulated).expect("written");
    std::fs::write(&right, BY_MODEL).expect("written");
    // A rig whose scanners are of other models than the recorded ones.
    let others = BY_MODEL.replace("lms111", "tim561").replace("picoscan150", "lms111");
    std::fs::write(&wrong, others).expect("written");
    let args = [&scene, "--scanner", "0", "--scanner", "1", "--tcp", "127.0.0.1:0", "--tcp", "127.0.0.1:0"];
    let flags = ["--time-scale", "max", "--record", &file];
    let (child, places) = listening("emulate", &[&args[..], &flags].concat(), 2);
    let emulator = Emulator { child, address: String::new() };
    let sources =
        places.iter().map(|place| format!("tcp://{}", place["address"].as_str().expect("an address")));
    let estimate = |sources: &[String], rig: &str| {
        let sources: Vec<&str> = sources.iter().map(String::as_str).collect();
        let flags = ["--rig", rig, "--scans", "60", "--format", "json"];
        let ended = run(&[&["estimate"], &sources[..], &flags].concat());
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let mut told: Value = serde_json::from_str(&ended.stdout).expect("JSON");
        told["scanners"].as_array_mut().expect("two").iter_mut().for_each(|one| drop(one["source"].take()));
        told["scanners"].take()
    };
    let live = estimate(&sources.collect::<Vec<_>>(), &right);
    emulator.end();
    let of = |file: &str| ["scanner0", "scanner1"].map(|stream| format!("{file}#{stream}"));
    assert_eq!(live, estimate(&of(&file), &right), "live is as recorded");
    assert_eq!(live, estimate(&of(&file), &wrong), "the recording's models count");
    with_models_swapped(file.as_ref(), twin.as_ref());
    assert_ne!(live, estimate(&of(&twin), &right), "a wrong model is not the same");
}

/// The rig's second scanner alone, and both: `export` and `estimate` place each stream by the mount that its recording names, as they do by `--scanner`.
#[test]
fn a_stream_lies_where_its_own_scanner_sits() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let scene = path("scene.toml");
    let two = "version = 2\n[orchard]\npreset = \"spindle\"\ntrees = 3\n[[rig.scanner]]\nmodel = \"lms111\"\nheight_m = 1.5\n\
        [[rig.scanner]]\nmodel = \"lms111\"\nheight_m = 1.8\ndistance_m = 2.3\noffset_y_m = 0.4\n";
    std::fs::write(&scene, two).expect("written");
    for scanners in [vec![1], vec![0, 1], vec![1, 0]] {
        let file = path(&format!("{scanners:?}.mcap"));
        let numbers: Vec<String> = scanners.iter().map(ToString::to_string).collect();
        let asked: Vec<&str> = numbers.iter().flat_map(|number| ["--scanner", number]).collect();
        let tcp = ["--tcp", "127.0.0.1:0"].repeat(scanners.len());
        let flags = ["--time-scale", "max", "--record", &file];
        let (child, places) =
            listening("emulate", &[&[scene.as_str()], &asked[..], &tcp, &flags].concat(), scanners.len());
        let emulator = Emulator { child, address: String::new() };
        let sources: Vec<String> = places
            .iter()
            .map(|place| format!("tcp://{}", place["address"].as_str().expect("an address")))
            .collect();
        let sources: Vec<&str> = sources.iter().map(String::as_str).collect();
        let live = run(&[&["estimate"], &sources[..], &["--rig", &scene, "--scans", "40"], &asked].concat());
        assert!(live.code.is_some(), "{}", live.stderr);
        emulator.end();
        let info = run(&["record", "--info", &file, "--format", "json"]);
        let told: Value = serde_json::from_str(&info.stdout).expect("JSON");
        let streams = told["streams"].as_array().expect("streams");
        for (stream, mount) in told["mounts"].as_object().expect("mounts") {
            assert!(streams.iter().any(|known| known["stream"] == stream.as_str()), "{stream}: {told}");
            let source = format!("{file}#{stream}");
            let table = |flags: &[&str]| {
                let to = path("points.csv");
                let ended =
                    run(&[&["export", &source, "--to", "csv", "-o", &to, "--rig", &scene], flags].concat());
                assert_eq!(ended.code, Some(0), "{}", ended.stderr);
                std::fs::read_to_string(to).expect("written")
            };
            let (own, other) = (mount.to_string(), (1 - mount.as_u64().expect("one of two")).to_string());
            assert_eq!(table(&[]), table(&["--scanner", &own]), "{stream} of {scanners:?}");
            assert_ne!(table(&[]), table(&["--scanner", &other]), "{stream} of {scanners:?}");
            let estimate = |flags: &[&str]| {
                let ended =
                    run(&[&["estimate", &source, "--rig", &scene, "--format", "json"], flags].concat());
                let told: Value = serde_json::from_str(&ended.stdout).expect("JSON");
                told["impacted_total_area_m2"].clone()
            };
            assert_eq!(estimate(&[]), estimate(&["--scanner", &own]), "{stream} of {scanners:?}");
        }
    }
}

/// Sources in another order than the rig's are found out where their models differ: then the recording does not say which scanner is which.
#[test]
fn a_recording_does_not_say_which_scanner_it_is_where_the_devices_say_otherwise() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let scene = path("scene.toml");
    let two = "version = 2\n[orchard]\npreset = \"spindle\"\ntrees = 2\n[[rig.scanner]]\nmodel = \"lms111\"\n\
        [[rig.scanner]]\nmodel = \"lms511\"\nrow = \"left\"\n";
    std::fs::write(&scene, two).expect("written");
    let args = [&scene, "--scanner", "0", "--scanner", "1", "--tcp", "127.0.0.1:0", "--tcp", "127.0.0.1:0"];
    let (child, places) = listening("emulate", &args, 2);
    let emulator = Emulator { child, address: String::new() };
    let address = |place: usize| format!("tcp://{}", places[place]["address"].as_str().expect("an address"));
    for (order, expected) in [([0, 1], serde_json::json!({ "one": 0, "two": 1 })), ([1, 0], Value::Null)] {
        let file = path(&format!("{order:?}.mcap"));
        let sources = [format!("one={}", address(order[0])), format!("two={}", address(order[1]))];
        let ended = run(&["record", &sources[0], &sources[1], "--rig", &scene, "-o", &file, "--scans", "5"]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let info = run(&["record", "--info", &file, "--format", "json"]);
        let told: Value = serde_json::from_str(&info.stdout).expect("JSON");
        assert_eq!(told["mounts"], expected, "{order:?}: {told}");
        let is_told = ended.stderr.contains("does not say which of the rig's scanners this is");
        assert_eq!(is_told, expected.is_null(), "{}", ended.stderr);
    }
    emulator.end();
}

/// What an emulator whose beams are told on its command line says of how to estimate it, run as it stands; with the flags before the source left out where
/// `leave_out` says so.
fn by_its_hint(optics: &str, leave_out: Option<&str>) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("two.toml");
    std::fs::write(&scene, SCENE).unwrap();
    let mut emulate = rowscan();
    // Time waits: a slow machine would leave turns out, and areas are withheld then.
    emulate.args(["emulate", scene.to_str().unwrap(), "--optics", optics, "--tcp", "127.0.0.1:0"]);
    emulate.args(["--time-scale", "max"]);
    let child = emulate.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the binary runs");
    let mut emulator = Emulator { child, address: String::new() };
    let said = BufReader::new(emulator.child.stderr.take().unwrap()).lines().map(|line| line.unwrap());
    let hint =
        { said }.find_map(|line| line.strip_prefix("estimate with: rowscan ").map(str::to_owned)).unwrap();
    let hint = leave_out.map_or(hint.clone(), |flag| hint.replace(flag, ""));
    let ended = run(&[hint.split(' ').collect(), vec!["--scans", "40", "--format", "json"]].concat());
    emulator.end();
    serde_json::from_str(&ended.stdout).unwrap_or_else(|why| panic!("{hint}: {why}\n{}", ended.stderr))
}

#[test]
fn a_hint_names_the_beams_that_the_command_line_gave_the_scanner() {
    let estimator = |found: &Value| found["leaf_area_estimator"].as_str().unwrap_or_default().to_owned();
    assert!(estimator(&by_its_hint("device", None)).ends_with("_spot_corrected"));
    assert!(!estimator(&by_its_hint("ideal", None)).ends_with("_spot_corrected"));
    // The scene's file has rays: without the flag the spot would stay in.
    assert!(!estimator(&by_its_hint("device", Some(" --optics device"))).ends_with("_spot_corrected"));
}
