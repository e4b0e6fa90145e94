//! What happens to clients that are one too many, or want what cannot be: they are told, and so is the user.

use crate::common;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, ChildStdout, Stdio};
use std::time::Duration;

use common::binary::{assert_says, interrupt, rowscan};
use common::captured::Talk;
use common::recorded::folder;
use serde_json::Value;

/// A command that listens, all of whose output is read.
struct Server {
    child: Child,
    stdout: BufReader<ChildStdout>,
    address: String,
}

impl Server {
    fn start(args: &[&str]) -> Self {
        let mut child = rowscan()
            .args(args)
            .args(["--tcp", "127.0.0.1:0", "--format", "jsonl"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary runs");
        let mut stdout = BufReader::new(child.stdout.take().expect("piped"));
        let mut line = String::new();
        stdout.read_line(&mut line).expect("text");
        let told: Value = serde_json::from_str(&line).expect("json");
        Self { child, stdout, address: told["address"].as_str().expect("an address").to_owned() }
    }

    fn connect(&self) -> Client {
        let stream = TcpStream::connect(&self.address).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time-out");
        Client(stream)
    }

    /// Ends it; its last line and what it said.
    fn end(mut self) -> (Value, String) {
        interrupt(&self.child);
        let (mut told, mut said) = (String::new(), String::new());
        self.stdout.read_to_string(&mut told).expect("text");
        self.child.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
        assert!(self.child.wait().expect("it ends").success(), "{said}");
        (serde_json::from_str(told.lines().last().expect("a last line")).expect("json"), said)
    }
}

struct Client(TcpStream);

impl Client {
    /// The answer to a telegram; none if the connection has ended.
    fn ask(&mut self, body: &str) -> Option<String> {
        self.0.write_all(format!("\x02{body}\x03").as_bytes()).ok()?;
        let mut answer = Vec::new();
        loop {
            let mut byte = [0];
            match self.0.read(&mut byte) {
                Ok(1) if byte == [3] => return String::from_utf8(answer).ok(),
                Ok(1) if byte == [2] => answer.clear(),
                Ok(1) => answer.push(byte[0]),
                _ => return None,
            }
        }
    }
}

const QUESTION: &str = "sRN SCdevicestate";

#[test]
fn clients_that_spoke_once_make_room_when_they_are_idle() {
    let server = Server::start(&["emulate", "--max-clients", "2", "--idle-limit", "0"]);
    let mut clients = [server.connect(), server.connect()];
    for client in &mut clients {
        assert_eq!(client.ask(QUESTION).as_deref(), Some("sRA SCdevicestate 1"));
    }
    let mut third = server.connect();
    assert_eq!(third.ask(QUESTION).as_deref(), Some("sRA SCdevicestate 1"));
    let gone = clients.iter_mut().filter_map(|client| client.ask(QUESTION).is_none().then_some(())).count();
    assert_eq!(gone, 1);
    let (last, said) = server.end();
    assert_eq!(
        (&last["event"], &last["connections_idle"], &last["connections_refused"]),
        (&"end".into(), &1.into(), &0.into())
    );
    assert_says(
        &said,
        &["makes room for 127.0.0.1", "it was idle", "0 refused, 0 closed as silent, 1 as idle"],
    );
}

#[test]
fn a_client_too_many_is_refused_and_told_who_it_was() {
    let server = Server::start(&["emulate", "--max-clients", "2"]);
    let mut clients = [server.connect(), server.connect()];
    for client in &mut clients {
        assert!(client.ask(QUESTION).is_some());
    }
    let mut third = server.connect();
    let port = third.0.local_addr().expect("bound").port();
    assert_eq!(third.ask(QUESTION), None);
    let silent = server.connect();
    drop((clients, silent));
    let (last, said) = server.end();
    assert!(last["connections_refused"].as_u64() >= Some(1), "{last}");
    assert_says(&said, &[&format!("127.0.0.1:{port} is refused: 2 clients are served"), "closed as silent"]);
}

#[test]
fn a_replay_says_which_settings_it_refused_and_to_whom() {
    let (_folder, file) = folder();
    let path = file("run.pcap");
    let mut talk = Talk::new();
    talk.connect(50_000, 1);
    (1..=20).for_each(|number| talk.scan(50_000, number));
    talk.write(&path);
    let server = Server::start(&["replay", &path, "--model", "lms111"]);
    let mut client = server.connect();
    assert_eq!(client.ask("sMN SetAccessMode 3 F4724744").as_deref(), Some("sAN SetAccessMode 1"));
    for _ in 0..2 {
        let answer = client.ask("sWN LMPoutputRange 1 1388 FFFF3CB0 1C3A90").expect("answered");
        assert!(answer.starts_with("sFA"), "{answer}");
    }
    // What does not change the scans is taken.
    assert_eq!(client.ask("sWN LocationName 3 row").as_deref(), Some("sWA LocationName"));
    let (_, said) = server.end();
    assert_says(&said, &["LMPoutputRange of 127.0.0.1", "refused LMPoutputRange to 127.0.0.1, 2 times"]);
    assert!(!said.contains("LocationName"), "{said}");
}
