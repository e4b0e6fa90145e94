//! What a service manager hears: READY=1, and by then everything can be reached.
#![cfg(target_os = "linux")]

use crate::common;

use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use common::binary::{Emulator, interrupt, rowscan, run, text};

/// Starts a command as systemd would, waits for READY=1, and connects to every address that it has announced.
fn is_ready_once_it_listens(arguments: &[&str], endpoints: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path().join("notify");
    let manager = UnixDatagram::bind(&place).expect("bound");
    manager.set_read_timeout(Some(Duration::from_secs(60))).expect("set");
    let mut child = rowscan()
        .args(arguments)
        .args(["--format", "jsonl"])
        .env("NOTIFY_SOCKET", &place)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary runs");
    let mut told = [0; 64];
    let length = manager.recv(&mut told).expect("the manager is told");
    assert_eq!(std::str::from_utf8(&told[..length]).expect("text").trim_end(), "READY=1", "{arguments:?}");
    let lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    for line in lines.take(endpoints) {
        let line: serde_json::Value = serde_json::from_str(&line.expect("text")).expect("json");
        let address = line["address"].as_str().expect("an address");
        TcpStream::connect(address).expect("it listens by then");
    }
    manager.set_nonblocking(true).expect("set");
    assert!(manager.recv(&mut told).is_err(), "it is told once");
    interrupt(&child);
    assert!(child.wait().expect("waited").success());
}

#[test]
fn commands_that_serve_tell_the_service_manager_once_they_listen() {
    let two = ["emulate", "post", "--tcp", "127.0.0.1:0", "--tcp", "127.0.0.1:0"];
    is_ready_once_it_listens(&two, 2);
    is_ready_once_it_listens(&["proxy", "tcp://127.0.0.1:1", "--tcp", "127.0.0.1:0"], 1);
    let folder = tempfile::tempdir().expect("a folder");
    let recording = folder.path().join("run.mcap");
    let scanner = Emulator::start(&["post"]);
    let recorded = run(&["record", &scanner.url(), "-o", text(&recording), "--scans", "20"]);
    assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
    is_ready_once_it_listens(&["replay", text(&recording), "--tcp", "127.0.0.1:0"], 1);
    is_ready_once_it_listens(&["watch", text(&recording), "--web", "127.0.0.1:0"], 1);
}

#[test]
fn a_manager_that_is_gone_stops_nobody() {
    let mut child = rowscan()
        .args(["emulate", "post", "--tcp", "127.0.0.1:0", "--format", "jsonl"])
        .env("NOTIFY_SOCKET", "/nowhere/notify")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary runs");
    let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    assert!(lines.any(|line| line.expect("text").contains("\"ready\"")), "it serves all the same");
    interrupt(&child);
    let ended = child.wait_with_output().expect("ended");
    assert!(ended.status.success());
    assert!(String::from_utf8_lossy(&ended.stderr).contains("NOTIFY_SOCKET"), "and says what is wrong");
}

#[test]
fn the_unit_waits_for_what_the_program_sends() {
    let unit = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/dist/rowscan@.service");
    let unit = std::fs::read_to_string(unit).expect("there");
    assert!(unit.contains("\nType=notify\n"));
    let start =
        unit.lines().find_map(|line| line.strip_prefix("ExecStart=/usr/bin/rowscan ")).expect("there");
    // What an instance has unless its own file says otherwise: that is read behind it.
    let (defaults, own) = unit.split_once("\nEnvironmentFile=-/etc/rowscan/%i.env\n").expect("there");
    assert!(own.contains("ExecStart="));
    let defaults = defaults.lines().find_map(|line| line.strip_prefix("Environment=")).expect("there");
    // Its command line is one that the program takes: another scene shows that nothing else is wrong.
    let mut start = start.to_owned();
    for setting in defaults.split(' ') {
        let (name, value) = setting.split_once('=').expect("a setting");
        let value = if value == "%I" { "no-such-scene" } else { value };
        assert!(start.contains(&format!("${{{name}}}")), "{name} is not used");
        start = start.replace(&format!("${{{name}}}"), value);
    }
    assert!(start.contains("--tcp 127.0.0.1:2111 --tcp 127.0.0.1:2112"), "{start}");
    let arguments: Vec<&str> = start.split(' ').collect();
    let ended = run(&arguments);
    assert_eq!(ended.code, Some(2));
    assert!(ended.stderr.contains("there is no scene `no-such-scene`"), "{}", ended.stderr);
}
