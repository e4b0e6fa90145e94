//! Ways for `emulate` to end by itself.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::common::binary::{Telling, assert_says, refused, rowscan};

/// Scans that a client gets until the emulator ends by itself, and what that tells.
fn driven(arguments: &[&str]) -> (usize, Vec<Value>) {
    let all = [&["spindle", "--tcp", "127.0.0.1:0", "--time-scale", "max"], arguments].concat();
    let mut telling = Telling::start("emulate", &all);
    let address = telling.address();
    let mut client = TcpStream::connect(address).expect("it listens");
    client.write_all(b"\x02sEN LMDscandata 1\x03").expect("sent");
    let mut bytes = Vec::new();
    client.read_to_end(&mut bytes).expect("it ends in order");
    // Without the reply.
    let scans = bytes.iter().filter(|byte| **byte == 0x03).count() - 1;
    (scans, std::iter::from_fn(|| telling.next()).collect())
}

#[test]
fn a_drive_ends_after_its_time_its_way_or_its_row() {
    // The first scan is the start of the drive; what is due at the end is sent. 50 Hz, 1 m/s.
    let rows_m = 12.0 * 1.5;
    for (flags, scans) in [(&["--seconds", "2"], 101), (&["--length", "0.5"], 26)] {
        let (sent, told) = driven(flags);
        assert_eq!(sent, scans, "{flags:?}");
        let end = told.last().expect("it tells its end");
        assert_eq!((end["event"].as_str(), end["scans_sent"].as_u64()), (Some("end"), Some(scans as u64)));
    }
    let (sent, _) = driven(&["--until-row-end"]);
    assert!(
        (sent as f64 / 50.0 - rows_m).abs() < 3.0,
        "{sent} scans for a row of {rows_m} m and its lead-in"
    );
    assert_says(&refused(&["emulate", "spindle", "--seconds", "0"]), &["above 0"]);
    assert_says(
        &refused(&["emulate", "spindle", "--seconds", "1", "--length", "1"]),
        &["cannot be used with"],
    );
}

#[cfg(unix)]
#[test]
fn it_ends_when_the_one_who_started_it_is_gone() {
    let binary = rowscan().get_program().to_owned();
    // A shell that waits for it, as its parent should.
    let script = r#""$0" emulate spindle --tcp 127.0.0.1:0 --exit-with-parent --format jsonl & wait"#;
    let mut shell = Command::new("sh")
        .args(["-c", script])
        .arg(binary)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("there is a shell");
    let mut lines = BufReader::new(shell.stdout.take().expect("piped")).lines();
    let mut next =
        || lines.next().map(|line| serde_json::from_str::<Value>(&line.expect("text")).expect("json"));
    assert_eq!(next().expect("it listens")["event"], "listening");
    assert_eq!(next().expect("it is ready")["event"], "ready");
    shell.kill().expect("it lives");
    shell.wait().expect("it is gone");
    // Its standard output ends with it.
    assert_eq!(next().expect("it ends in order")["event"], "end");
    assert!(next().is_none());
}
