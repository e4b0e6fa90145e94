//! What `estimate` makes of what a recording says of itself: its scanner's model, the stream that is read, the optics it was made with.

use std::io::{BufRead, BufReader, Cursor};
use std::process::Stdio;

use rowscan_protocol::frame::{Dialect, encode};
use rowscan_recording::{About, Decoded, McapWriter, Side, StreamKind};
use serde_json::Value;

use crate::common::binary::{Emulator, Ended, Telling, assert_says, rowscan, run};
use crate::common::recorded::folder;

fn json(ended: &Ended) -> Value {
    serde_json::from_str(&ended.stdout).unwrap_or_else(|_| panic!("{}", ended.stderr))
}

/// An estimate as JSON, whatever it withholds, and what was said beside it.
fn estimated(source: &str, args: &[&str]) -> (Value, String) {
    let ended = run(&[&["estimate", source, "--format", "json"], args].concat());
    (json(&ended), ended.stderr)
}

/// Its warning of this code.
fn warning<'a>(told: &'a Value, code: &str) -> Option<&'a str> {
    let warnings = told["warnings"].as_array().expect("a list").iter().filter_map(Value::as_str);
    warnings.into_iter().find(|warning| warning.starts_with(&format!("{code}: ")))
}

/// `record` keeps a live scanner's model where the scanner says it, and `estimate` reads the recording as one of that model.
#[test]
fn a_recorded_scanner_is_read_as_the_model_that_it_said_it_is() {
    let (_folder, file) = folder();
    let rig = file("row.toml");
    let tcp = ["--tcp", "127.0.0.1:0"];
    for (model, rest, said) in [
        ("picoscan150", true, true),
        ("multiscan136", true, true),
        ("mrs1000", false, true),
        // Its name is that of a family, of which the rig's model is one.
        ("lms111", false, false),
    ] {
        let rest = if rest { &["--rest", "127.0.0.1:0"][..] } else { &[] };
        let scale = ["--time-scale", if model == "multiscan136" { "0.1" } else { "1" }];
        let args = [&[rig.as_str(), "--model", model], &tcp[..], rest, &scale].concat();
        let mut emulator = Telling::start("emulate", &args);
        let tcp = emulator.address();
        let source = if rest.is_empty() {
            format!("tcp://{tcp}")
        } else {
            format!("picoscan://{}?udp=0", emulator.address())
        };
        let recorded = file(&format!("{model}.mcap"));
        let ended = run(&["record", &source, "-o", &recorded, "--scans", "10"]);
        assert_eq!(ended.code, Some(0), "{model}: {}", ended.stderr);
        let info = json(&run(&["record", "--info", &recorded, "--format", "json"]));
        assert_eq!(info["model"], if said { Value::from(model) } else { Value::Null }, "{model}");
        let (told, stderr) = estimated(&recorded, &["--rig", &rig]);
        assert_eq!(stderr.contains(&format!("names the model {model}")), said, "{model}: {stderr}");
        assert_eq!(warning(&told, "other_model"), None, "{model}");
        assert_eq!(told, estimated(&recorded, &["--rig", &rig, "--model", model]).0, "{model}");
        // The wrong twin: another model than the scanner said, and none of its family.
        let (told, _) = estimated(&recorded, &["--rig", &rig, "--model", "tim571"]);
        assert!(warning(&told, "other_model").is_some(), "{model}: {told}");
    }
}

/// Scans behind a reply to DeviceIdent, in bytes, which name no model otherwise.
#[test]
fn what_a_scanner_called_itself_in_the_file_is_held_against_the_model() {
    let (folder, file) = folder();
    let rig = file("row.toml");
    let path = folder.path().join("one.bin");
    for (name, model, is_told) in [
        ("LMS511", "lms111", true),
        ("LMS511", "lms511", false),
        ("LMS10x_FieldEval", "lms511", true),
        ("LMS10x_FieldEval", "lms111", false),
        ("Somebody", "lms111", false),
    ] {
        let mut bytes = format!("\x02sRA DeviceIdent {:X} {name} 5 V1.80\x03", name.len());
        for n in 1..20 {
            let t = n * 20_000;
            bytes += &format!(
                "\x02sSN LMDscandata 1 1 A1B2C3 0 0 {n:X} {n:X} {t:X} {t:X} 0 0 0 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 21D{} 0 0 0 0 0 0\x03",
                " 7D0".repeat(541)
            );
        }
        std::fs::write(&path, bytes).expect("it is written");
        let path = path.to_str().expect("UTF-8");
        let (told, _) = estimated(path, &["--rig", &rig, "--model", model]);
        assert_eq!(warning(&told, "other_model").is_some(), is_told, "{name} as {model}: {told}");
        if model == "lms111" {
            // The rig's model, where none is asked for.
            let exported = run(&["export", path, "--rig", &rig, "--to", "csv", "-o", "-"]);
            assert_eq!(
                exported.stderr.contains("correct the rig's `model`"),
                is_told,
                "{name}: {}",
                exported.stderr
            );
        }
    }
}

/// A recording of these streams, whose scans have so many beams, in the order in which they came.
fn streams(path: &str, order: &[(&str, usize)]) {
    let mut writer = McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default())
        .expect("a recording in memory");
    let ids: Vec<_> = order
        .iter()
        .map(|(name, beams)| (writer.add_stream(name, StreamKind::Cola).expect("added"), *beams))
        .collect();
    for number in 1..=40_u64 {
        for (stream, beams) in &ids {
            let body = format!(
                "sSN LMDscandata 1 1 16F4C7A 0 0 {number:X} {number:X} {0:X} {0:X} 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 {beams:X} {1} 0 0 0 0 0 0",
                number * 20_000,
                vec!["7D0"; *beams].join(" "),
            );
            let mut bytes = Vec::new();
            encode(Dialect::A, body.as_bytes(), &mut bytes);
            writer.write(*stream, Side::Device, number * 20_000_000, 0, &bytes).expect("written");
        }
    }
    writer.finish().expect("finished");
    std::fs::write(path, writer.into_inner().into_inner()).expect("written");
}

#[test]
fn of_two_streams_the_first_by_name_is_read_and_the_document_says_so() {
    let (_folder, file) = folder();
    let path = file("two.mcap");
    let mut told = Vec::new();
    for order in [[("left", 3), ("right", 5)], [("right", 5), ("left", 3)]] {
        streams(&path, &order);
        let (found, stderr) = estimated(&path, &[]);
        assert_eq!((&found["points_per_scan"], &found["scans"]), (&3.into(), &40.into()), "{order:?}");
        let warned = warning(&found, "streams_left_out").unwrap_or_else(|| panic!("{order:?}: {found}"));
        assert_says(warned, &["`left`", "left out: right", "FILE#STREAM"]);
        assert_says(&stderr, &["left out: right"]);
        // One that ends early knows it as well.
        let (early, _) = estimated(&path, &["--scans", "1"]);
        assert!(warning(&early, "streams_left_out").is_some(), "{early}");
        told.push(found);
        for (stream, points) in [("left", 3), ("right", 5)] {
            let (found, _) = estimated(&format!("{path}#{stream}"), &[]);
            assert_eq!(found["points_per_scan"], points, "{stream}");
            assert_eq!(warning(&found, "streams_left_out"), None, "{stream} was named");
        }
    }
    assert_eq!(told[0], told[1], "which scanner connected first changes nothing");
}

/// Whether a replay of this file says which beams it was recorded with.
fn replay_says(file: &str, expected: &str) -> bool {
    let mut replay = rowscan();
    replay.args(["replay", file, "--tcp", "127.0.0.1:0"]).stderr(Stdio::piped()).stdout(Stdio::null());
    let mut child = replay.spawn().expect("the binary runs");
    let said = BufReader::new(child.stderr.take().expect("piped")).lines().map_while(Result::ok);
    let said: Vec<String> = said.take_while(|line| !line.contains("it begins")).collect();
    child.kill().expect("it ran");
    child.wait().expect("it ended");
    said.iter().any(|line| line.contains(expected))
}

/// Scans through a device's beams, read with a rig that says rays: an emulator knows what it made; of a real scanner the rig is believed. Both are told.
#[test]
fn the_optics_that_an_emulator_recorded_decide_over_the_rigs() {
    let (_folder, file) = folder();
    let (ideal, device) = (file("row.toml"), file("device.toml"));
    let scene = std::fs::read_to_string(&ideal).expect("written");
    std::fs::write(&device, scene + "[optics]\nstages = \"device\"\n").expect("written");
    let (made, kept) = (file("made.mcap"), file("kept.mcap"));
    let emulator = Emulator::start(&[&device, "--time-scale", "max", "--record", &made]);
    let ended = run(&["record", &emulator.url(), "-o", &kept, "--rig", &device, "--scans", "100"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    emulator.end();
    let leaf = |told: &Value| told["leaf_area_contact_raw_m2"].as_f64().unwrap_or_else(|| panic!("{told}"));
    let (right, _) = estimated(&made, &["--rig", &device]);
    assert_eq!((warning(&right, "other_optics"), warning(&right, "other_rig")), (None, None));
    assert!(replay_says(&made, "estimate the replay with --optics device"));
    let (found, stderr) = estimated(&made, &["--rig", &ideal]);
    assert_eq!(leaf(&found), leaf(&right), "the recording's optics decide");
    let warned = warning(&found, "other_optics").unwrap_or_else(|| panic!("{found}"));
    assert_says(warned, &["optics device, which decides", "the rig says ideal"]);
    assert_says(&stderr, &["other_optics"]);
    // The wrong twin: the same scans, and nobody who knows.
    let (right, _) = estimated(&kept, &["--rig", &device]);
    assert!(leaf(&right) > 0.0);
    let (found, _) = estimated(&kept, &["--rig", &ideal]);
    assert_eq!(found["leaf_area_withheld"], "other_beams", "the rig decides, and the scans contradict it");
    let warned = warning(&found, "other_optics").unwrap_or_else(|| panic!("{found}"));
    assert_says(warned, &["the rig says ideal, which decides"]);
    // What else is another is told by its keys.
    let far = file("far.toml");
    let scene = std::fs::read_to_string(&device).expect("written");
    std::fs::write(&far, scene + "[[rig.scanner]]\ndistance_m = 2.5\n").expect("written");
    let (found, _) = estimated(&made, &["--rig", &far]);
    let warned = warning(&found, "other_rig").unwrap_or_else(|| panic!("{found}"));
    assert_says(warned, &["distance_m 1.9 (here 2.5)"]);
}
