//! Same scene, same seed: the same bytes, run to run and on any number of threads. The whole binary is asked.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::time::Duration;

fn rowscan(threads: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rowscan"));
    command.env("RAYON_NUM_THREADS", threads);
    command
}

fn grown(threads: &str, seed: &str) -> (Vec<u8>, Vec<u8>) {
    let folder = tempfile::tempdir().expect("a folder");
    let prefix = folder.path().join("row");
    let grown = rowscan(threads)
        .args(["orchard", "grow", "spindle", "--seed", seed, "--output"])
        .arg(&prefix)
        .output()
        .expect("it runs");
    assert!(grown.status.success(), "{}", String::from_utf8_lossy(&grown.stderr));
    let read = |part: &str| std::fs::read(folder.path().join(part)).expect("written");
    (read("row_leaves.txt"), read("row_branches.txt"))
}

#[test]
fn an_orchard_has_the_same_bytes_on_any_number_of_threads() {
    let (leaves, branches) = grown("1", "7");
    assert!(leaves.len() > 1_000_000, "a grown row: {} bytes of leaves", leaves.len());
    for threads in ["2", "16"] {
        assert!(grown(threads, "7") == (leaves.clone(), branches.clone()), "{threads} threads");
    }
    assert!(grown("1", "8").0 != leaves, "another seed, another orchard");
}

/// The first bytes a plain CoLa A client receives after it subscribes.
fn telegrams(threads: &str) -> Vec<u8> {
    let mut emulator = rowscan(threads)
        .args([
            "emulate",
            "spindle",
            "--seed",
            "7",
            "--tcp",
            "127.0.0.1:0",
            "--time-scale",
            "max",
            "--format",
            "jsonl",
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("it runs");
    let mut line = String::new();
    BufReader::new(emulator.stdout.take().expect("piped")).read_line(&mut line).expect("a line");
    let address = line.split('"').rev().nth(1).expect("an address").to_owned();
    let mut stream = TcpStream::connect(&address).expect("it listens");
    stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a time-out");
    stream.write_all(b"\x02sEN LMDscandata 1\x03").expect("sent");
    let mut bytes = vec![0; 400_000];
    stream.read_exact(&mut bytes).expect("scans");
    emulator.kill().expect("it ends");
    emulator.wait().expect("it ended");
    bytes
}

#[test]
fn telegrams_have_the_same_bytes_run_to_run() {
    let first = telegrams("1");
    assert!(first.starts_with(b"\x02sEA LMDscandata 1\x03\x02sSN LMDscandata "));
    for threads in ["1", "4"] {
        assert!(telegrams(threads) == first, "{threads} threads");
    }
}
