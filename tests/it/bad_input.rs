//! Bad input gets one clear message and exit code 2.

use crate::common;

use std::io::{Read, Write};
use std::net::TcpListener;

use common::binary::{Emulator, assert_says, refused, run};

fn file(name: &str, content: &[u8]) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, content).expect("written");
    let path = path.to_str().expect("UTF-8").to_owned();
    (folder, path)
}

#[test]
fn an_unknown_model_lists_the_known_ones() {
    assert_says(&refused(&["demo", "--model", "lms999"]), &["lms999", "lms111", "lms511", "rowscan models"]);
    assert_says(&refused(&["emulate", "--model", "lms999"]), &["lms999", "lms111"]);
}

#[test]
fn a_missing_scene_names_the_built_in_ones() {
    let message = refused(&["emulate", "spindel"]);
    assert_says(&message, &["no scene `spindel`", "spindle, ", "did you mean `spindle`?"]);
    assert_says(
        &refused(&["orchard", "truth", "/nowhere/scene.toml"]),
        &["/nowhere/scene.toml", "built in are"],
    );
}

#[test]
fn an_unknown_key_names_file_line_and_nearest_key() {
    let (_folder, path) = file("row.toml", b"version = 1\n\n[orchard]\ntree_spacing = 2\n");
    let message = refused(&["orchard", "truth", &path]);
    assert_says(
        &message,
        &[&format!("{path}:4:"), "unknown key `tree_spacing`", "did you mean `tree_spacing_m`?"],
    );
}

#[test]
fn a_matrix_that_is_not_stochastic_names_the_row_and_its_sum() {
    let scene = b"version = 1\n[orchard.tree]\ntransitions = [[0.5, 0.2, 0.2, 0.2], [0, 0, 0, 1], [0, 0, 0, 1], [0, 0, 0, 1]]\n";
    let (_folder, path) = file("row.toml", scene);
    assert_says(
        &refused(&["orchard", "grow", &path]),
        &["orchard.tree.transitions", "row L must sum to 1", "1.0999"],
    );
}

#[test]
fn a_scene_of_another_version_or_an_impossible_rig_is_refused() {
    let (_folder, path) = file("row.toml", b"version = 3\n");
    assert_says(&refused(&["emulate", &path]), &["version must be 1 or 2, found 3"]);
    let (_folder, path) = file("row.toml", b"version = 1\n[[rig.scanner]]\ndistance_m = -1\n");
    assert_says(&refused(&["emulate", &path]), &["distance_m", "positive", "-1"]);
    let (_folder, path) = file("row.toml", b"version = 1\n[[rig.scanner]]\nfrequency_hz = 33\n");
    assert_says(&refused(&["emulate", &path]), &["LMS111", "33"]);
}

#[test]
fn a_calibration_without_class_or_units_is_refused() {
    let sound = rowscan_canopy::shipped::text("spindle-lms111").expect("it ships");
    let unitless = sound.replace("units = \"m2\"", "");
    let classless = &sound[..sound.find("[class]").expect("a class")].to_owned();
    for (text, key) in [(unitless.as_str(), "`units`"), (classless.as_str(), "`class`")] {
        let (_folder, path) = file("calibration.toml", text.as_bytes());
        let message = refused(&["estimate", "tcp://127.0.0.1:1", "--rig", "spindle", "--calibration", &path]);
        assert_says(&message, &["calibration.toml:", key, "missing"]);
    }
}

#[test]
fn a_busy_port_is_named_with_a_way_out() {
    let holder = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = holder.local_addr().expect("bound").to_string();
    assert_says(&refused(&["emulate", "--tcp", &address]), &[&address, "in use", "127.0.0.1:0"]);
    assert_says(&refused(&["emulate", "--tcp", "nonsense"]), &["nonsense", "HOST:PORT"]);
}

#[test]
fn an_unreachable_host_is_named() {
    let free = TcpListener::bind("127.0.0.1:0").expect("a free port").local_addr().expect("bound");
    let message = refused(&["estimate", &format!("tcp://{free}")]);
    assert_says(&message, &["cannot connect", &free.to_string(), "2111 or 2112"]);
}

#[test]
fn sources_that_are_none_are_refused() {
    let unknown = run(&["estimate", "gopher://x"]);
    assert_eq!(unknown.code, Some(2));
    assert_says(&unknown.stderr, &["gopher", "tcp://HOST:PORT"]);
    assert_says(&refused(&["estimate", "/nowhere.bin"]), &["/nowhere.bin", "No such file"]);
    let (_folder, path) = file("holiday.jpg", &[0xFF; 5000]);
    assert_says(&refused(&["estimate", &path]), &["holiday.jpg", "no SICK telegram", "5000 bytes"]);
    let (_folder, path) = file("empty.bin", b"");
    assert_says(&refused(&["estimate", &path]), &["empty.bin", "0 bytes"]);
}

/// A peer that does one thing to every client.
fn peer(act: fn(&mut std::net::TcpStream)) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("bound").to_string();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            act(&mut stream.expect("a client"));
        }
    });
    format!("tcp://{address}")
}

#[test]
fn a_peer_that_is_no_scanner_is_told_apart_from_one_that_is_silent() {
    let silent = peer(|stream| {
        let _ = stream.read_to_end(&mut Vec::new());
    });
    assert_says(
        &refused(&["estimate", &silent]),
        &["does not answer as a SICK scanner", "CoLa B nor in CoLa A"],
    );
    let garbage = peer(|stream| {
        let _ = stream.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n");
        let _ = stream.read_to_end(&mut Vec::new());
    });
    assert_says(
        &refused(&["estimate", &garbage]),
        &["bytes came that are no telegram", "picoscan://127.0.0.1:"],
    );
    // A web server that closes at once, and one that says nothing.
    let closing = peer(|stream| {
        let _ = stream.read(&mut [0; 100]);
        let _ = stream.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n");
    });
    let mute = peer(|stream| {
        let _ = stream.read(&mut [0; 100]);
    });
    for (url, found) in [(closing, "bytes that are no telegram"), (mute, "found nothing")] {
        let remedy = ["closed the connection during start-up", "expected an answer", "picoscan://127.0.0.1:"];
        assert_says(&refused(&["estimate", &url]), &[&remedy[..], &[found]].concat());
    }
}

#[test]
fn a_peer_that_closes_in_the_middle_of_a_telegram_is_named() {
    let quitter = peer(|stream| {
        let _ = stream.read(&mut [0; 100]);
        let _ = stream.write_all(&[2, 2, 2, 2, 0, 0, 0, 40, b's', b'R']);
    });
    assert_says(&refused(&["estimate", &quitter]), &["closed the connection during start-up"]);
}

#[test]
fn a_device_of_the_other_dialect_is_found_without_being_asked_for() {
    let emulator = Emulator::start(&["--dialect", "a", "--time-scale", "max"]);
    let ended = run(&["estimate", &emulator.url(), "--scans", "5", "--format", "json"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_says(&ended.stderr, &["CoLa A"]);
    assert_says(&ended.stdout, &["\"scans\": 5"]);
}

#[test]
fn lengths_speeds_and_models_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let standing = folder.path().join("standing.toml");
    let text = "version = 1\n[orchard]\ntrees = 1\n[orchard.tree]\niterations = 7\n[rig]\nspeed_m_s = 0.0\n";
    std::fs::write(&standing, text).expect("written");
    let standing = standing.to_str().expect("UTF-8");
    for (arguments, says) in [
        (&["demo", standing][..], "found `speed_m_s = 0`"),
        (&["estimate", "x.mcap", "--length", "nan"], "expected a number of metres above 0, found `nan`"),
        (&["estimate", "x.mcap", "--length", "-1"], "expected a number of metres above 0, found `-1`"),
        (&["estimate", "x.mcap", "--model", "lms111"], "--rig"),
    ] {
        let ended = run(arguments);
        assert_eq!(ended.code, Some(2), "{arguments:?}: {}", ended.stderr);
        assert!(ended.stderr.contains(says), "{arguments:?}: {}", ended.stderr);
    }
}

#[test]
fn a_number_below_zero_is_an_options_value_and_refused_by_its_name() {
    for (args, option) in [
        (&["emulate", "--time-scale", "-1"][..], "--time-scale"),
        (&["emulate", "--seconds", "-1"], "--seconds"),
        (&["emulate", "--uptime", "-5"], "--uptime"),
        (&["demo", "--seed", "-1"], "--seed"),
        (&["replay", "x.mcap", "--time-scale", "-0.5"], "--time-scale"),
    ] {
        let said = refused(args);
        assert!(said.contains(option) && !said.contains("unexpected argument"), "{args:?}: {said}");
    }
}

#[test]
fn a_recording_is_not_recorded_again_by_an_estimate() {
    let folder = tempfile::tempdir().expect("a folder");
    let new = folder.path().join("new.mcap");
    let said = refused(&["estimate", "run.mcap", "--record", crate::common::binary::text(&new)]);
    assert!(said.contains("rowscan record FILE -o NEW") && !new.exists(), "{said}");
}

#[test]
fn whatever_reads_a_file_says_where_it_looked_for_one_that_is_not_there() {
    let here = std::env::current_dir().expect("a working folder");
    let commands: [&[&str]; 8] = [
        &["estimate", "none.bin"],
        &["record", "--info", "none.mcap"],
        &["record", "--repair", "none.mcap", "-o", "-"],
        &["replay", "none.mcap", "--tcp", "127.0.0.1:0"],
        &["export", "none.mcap", "--to", "csv", "-o", "-"],
        &["decode", "none.bin"],
        &["bus", "decode", "none.log"],
        &["emulate", "spindle", "--faults", "none.toml", "--tcp", "127.0.0.1:0"],
    ];
    for command in commands {
        assert_says(&refused(command), &["none.", &format!("a relative path starts at {}", here.display())]);
    }
    assert_says(&refused(&["study", "run", "none.toml"]), &["none.toml", "a relative path starts at"]);
    // What is there and cannot be read has another reason.
    let named = format!("{}#left", here.join("Cargo.toml").to_string_lossy());
    assert_says(&refused(&["decode", &named]), &["the stream `left`", "record", "-o NEW.mcap"]);
    let folder = refused(&["decode", &here.join("src").to_string_lossy()]);
    assert!(!folder.contains("a relative path"), "{folder}");
}
