//! SIGTERM ends every command, whatever it reads: a FIFO that nobody writes to, zeros without an end.

use std::io::Write;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::telegram::wire::FixedText;
use rowscan_protocol::telegram::{Channel, Kind, LmdScandata, Variable, encode_frame};

use crate::common::binary::{finish, rowscan, text};

/// What each command reads: `F` is the file. A command that is not here and reads a file fails the test below.
const CASES: &[&[&str]] = &[
    &["demo", "F"],
    &["emulate", "F", "--tcp", "127.0.0.1:0"],
    &["emulate", "post", "--tcp", "127.0.0.1:0", "--faults", "F"],
    &["check", "F"],
    &["estimate", "F"],
    &["estimate", "F", "--rig", "post"],
    &["watch", "F", "--web", "127.0.0.1:0"],
    &["orchard", "grow", "F"],
    &["orchard", "truth", "F"],
    &["orchard", "import", "--leaves", "F"],
    &["orchard", "export", "F", "--svg", "/dev/null"],
    &["orchard", "render", "F", "-o", "/dev/null"],
    &["orchard", "statistics", "F"],
    &["orchard", "parameters", "F"],
    &["scan", "F"],
    &["study", "areas", "F"],
    &["study", "resolution", "F"],
    &["study", "run", "F"],
    &["study", "search", "F"],
    &["study", "merge", "F"],
    &["study", "calibration", "F"],
    &["study", "accuracy", "F"],
    &["study", "budget", "F"],
    &["study", "transfer", "--classes", "F"],
    &["study", "coverage", "--classes", "F"],
    &["study", "estimators", "F"],
    &["study", "eye", "F"],
    &["study", "field", "F", "--rig", "spindle"],
    &["study", "pieces", "F"],
    &["study", "clumping", "F"],
    &["study", "sides", "F"],
    &["study", "physics", "F"],
    &["study", "recording", "F", "--model", "lms111"],
    &["record", "F", "-o", "/dev/null"],
    &["record", "--info", "F"],
    &["record", "--repair", "F"],
    &["replay", "F", "--tcp", "127.0.0.1:0"],
    &["export", "F", "--to", "csv", "-o", "/dev/null"],
    &["decode", "F"],
    &["bus", "decode", "F"],
    &["proxy", "tcp://127.0.0.1:9", "--tcp", "127.0.0.1:0", "--faults", "F"],
    &["scene", "check", "F"],
    &["scene", "show", "F"],
    &["rig", "check", "F"],
    &["rig", "show", "F"],
    &["score", "F"],
    &["spray", "tcp://127.0.0.1:9", "--can", "udp:239.74.163.2:43113", "--boom", "F"],
];

/// Commands that read nothing.
const READ_NOTHING: &[&str] =
    &["bus dbc", "bus markdown", "completions", "faults", "man", "models", "rig new", "scene new", "schema"];

#[test]
fn every_command_is_known_here() {
    let mut unknown = Vec::new();
    visit(&rowscan::cli::command(), &[], &mut unknown);
    assert!(unknown.is_empty(), "say above what they read: {unknown:?}");
}

fn visit<'a>(command: &'a clap::Command, above: &[&'a str], unknown: &mut Vec<String>) {
    for sub in command.get_subcommands() {
        let name = [above, &[sub.get_name()]].concat();
        if sub.has_subcommands() {
            visit(sub, &name, unknown);
        } else if !READ_NOTHING.contains(&name.join(" ").as_str())
            && !CASES.iter().any(|case| case.starts_with(&name))
        {
            unknown.push(name.join(" "));
        }
    }
}

/// Runs all commands at once on `file`, which may be refused before the signal comes, and ends them once each of them reads.
fn ended_by_a_signal(file: &str, may_refuse: bool) -> Vec<String> {
    let started = CASES.iter().map(|case| {
        let line: Vec<&str> = case.iter().map(|word| if *word == "F" { file } else { word }).collect();
        let mut command = rowscan();
        command.args(&line).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        (line.join(" "), command.spawn().expect("the binary runs"))
    });
    let started: Vec<(String, Child)> = started.collect();
    // They read on, or have refused the file.
    std::thread::sleep(Duration::from_secs(2));
    for (_, child) in &started {
        let _ = Command::new("kill").args(["-TERM", &child.id().to_string()]).stderr(Stdio::null()).status();
    }
    let mut wrong = Vec::new();
    for (line, child) in started {
        let ended = finish(child);
        // Commands that serve end in order with 0; none: the system ended what had hardly begun.
        let is_right = match ended.code {
            Some(143 | 0) | None => true,
            Some(1 | 2) => may_refuse,
            _ => false,
        };
        if !is_right {
            wrong.push(format!("{line}: exit {:?}: {}", ended.code, ended.stderr));
        }
    }
    wrong
}

#[test]
fn a_signal_ends_what_waits_for_a_pipe() {
    let folder = tempfile::tempdir().expect("a folder");
    let fifo = folder.path().join("fifo");
    assert!(Command::new("mkfifo").arg(&fifo).status().expect("mkfifo runs").success());
    let wrong = ended_by_a_signal(text(&fifo), false);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_signal_ends_what_reads_without_an_end() {
    // Readers of recordings go on for ever; what is read whole is refused at its bound.
    let wrong = ended_by_a_signal("/dev/zero", true);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_file_that_never_ends_is_refused_at_its_bound() {
    for case in CASES
        .iter()
        .filter(|case| !READS_RECORDINGS.contains(&case[0]) && case[..2] != ["study", "recording"])
    {
        let line: Vec<&str> = case.iter().map(|word| if *word == "F" { "/dev/zero" } else { word }).collect();
        let child = rowscan()
            .args(&line)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary runs");
        let ended = finish(child);
        assert_eq!(ended.code, Some(2), "{line:?}: {}", ended.stderr);
        // A scenario that cannot be read is a verdict of its own.
        let said = ended.stderr + &ended.stdout;
        assert!(said.contains("expected at most"), "{line:?}: {said}");
    }
}

/// These take what they read piece by piece.
const READS_RECORDINGS: &[&str] = &["estimate", "watch", "record", "replay", "export", "decode"];

#[test]
fn a_part_of_a_file_is_no_estimate() {
    let folder = tempfile::tempdir().expect("a folder");
    let fifo = folder.path().join("scans");
    assert!(Command::new("mkfifo").arg(&fifo).status().expect("it runs").success());
    for (signal, code) in [("INT", 130), ("TERM", 143), ("HUP", 129)] {
        let mut command = rowscan();
        command.args(["estimate", text(&fifo), "--format", "json"]).stdin(Stdio::null());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = command.spawn().expect("the binary runs");
        let path = fifo.clone();
        // Scans without an end: whenever the signal comes, there are more.
        let writing = std::thread::spawn(move || {
            let channel = Channel {
                name: FixedText(*b"DIST1"),
                scale: 1.0,
                step: 5000,
                values: vec![1500; 541],
                ..Channel::default()
            };
            let mut scan =
                LmdScandata { scan_frequency: 5000, channels16: vec![channel], ..LmdScandata::default() };
            let mut writer = std::fs::OpenOptions::new().write(true).open(path).expect("read by the command");
            loop {
                scan.telegram_counter = scan.telegram_counter.wrapping_add(1);
                scan.scan_counter = scan.telegram_counter;
                scan.scan_time_us = scan.scan_time_us.wrapping_add(20_000);
                let mut bytes = Vec::new();
                encode_frame(Dialect::B, Kind::Sn, LmdScandata::NAME, &scan, &mut bytes);
                if writer.write_all(&bytes).is_err() {
                    break;
                }
            }
        });
        std::thread::sleep(Duration::from_secs(1));
        let told = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status();
        assert!(told.expect("it runs").success());
        let ended = finish(child);
        assert_eq!((ended.code, ended.stdout.as_str()), (Some(code), ""), "{signal}: {}", ended.stderr);
        assert!(ended.stderr.contains("there is no estimate of the whole"), "{signal}: {}", ended.stderr);
        writing.join().expect("nobody reads any more");
    }
}
