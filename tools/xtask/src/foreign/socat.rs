//! socat as a TCP client: CoLa A typed by hand, as with any terminal.

use std::io::Write;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use super::with_programs;
use crate::counts::Counts;
use crate::emulator::Emulator;
use crate::shell;
use crate::steps::Outcome;
use crate::workspace::Workspace;

const STX: u8 = 0x02;
const ETX: u8 = 0x03;

/// How long any one telegram may take to come.
const PATIENCE: Duration = Duration::from_secs(10);

/// The whole conversation.
pub fn run(workspace: &Workspace) -> Outcome {
    with_programs(workspace, &["socat"], &["socat"], converse)
}

fn converse(workspace: &Workspace) -> Outcome {
    let mut counts = Counts::default();
    let result = Emulator::start(workspace, &["--model", "lms111"]).and_then(|emulator| {
        counts.passed += 1;
        talk(&emulator.place, &mut counts)?;
        emulator.stop()?;
        counts.passed += 1;
        Ok(())
    });
    Outcome::from_tests(counts, result)
}

/// Asks who it is, subscribes, and reads scans.
fn talk(address: &str, counts: &mut Counts) -> Result<(), String> {
    let mut client = Client::connect(address)?;
    client.send("sRN DeviceIdent")?;
    let identity = client.receive()?;
    expect(identity.starts_with("sRA DeviceIdent "), "an answer to sRN DeviceIdent", &identity)?;
    expect(identity.contains("LMS1"), "a name of the LMS1xx family", &identity)?;
    counts.passed += 1;
    client.send("sEN LMDscandata 1")?;
    let answer = client.receive()?;
    expect(answer == "sEA LMDscandata 1", "sEA LMDscandata 1", &answer)?;
    counts.passed += 1;
    let mut last = None;
    for _ in 0..5 {
        let scan = client.receive()?;
        expect(scan.starts_with("sSN LMDscandata "), "a scan telegram", &scan)?;
        let token = |i: usize| {
            let token = scan.split(' ').nth(i).unwrap_or("");
            u32::from_str_radix(token, 16).map_err(|_| format!("token {i} of a scan telegram is `{token}`"))
        };
        let (counter, points) = (token(8)?, token(25)?);
        expect(points == 541, "541 points", &points.to_string())?;
        expect(
            last.is_none_or(|last: u32| (last + 1) & 0xffff == counter),
            "the next scan counter",
            &counter.to_string(),
        )?;
        last = Some(counter);
    }
    counts.passed += 1;
    Ok(())
}

fn expect(holds: bool, expected: &str, found: &str) -> Result<(), String> {
    let short: String = found.chars().take(80).collect();
    if holds { Ok(()) } else { Err(format!("expected {expected}, found `{short}`")) }
}

/// socat between our pipes and the scanner.
struct Client {
    child: Child,
    pieces: Receiver<Vec<u8>>,
    received: Vec<u8>,
}

impl Client {
    fn connect(address: &str) -> Result<Self, String> {
        let mut child = Command::new("socat")
            .args(["-", &format!("TCP:{address}")])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| format!("cannot start socat: {error}"))?;
        let pieces = shell::stdout_bytes(&mut child)?;
        Ok(Self { child, pieces, received: Vec::new() })
    }

    fn send(&mut self, text: &str) -> Result<(), String> {
        let frame = [&[STX], text.as_bytes(), &[ETX]].concat();
        let stdin = self.child.stdin.as_mut().ok_or("socat's stdin is closed")?;
        stdin.write_all(&frame).and_then(|()| stdin.flush()).map_err(|error| format!("socat: {error}"))
    }

    /// The next telegram's text.
    fn receive(&mut self) -> Result<String, String> {
        let end = Instant::now() + PATIENCE;
        loop {
            if let Some(length) = self.received.iter().position(|&byte| byte == ETX) {
                let frame: Vec<u8> = self.received.drain(..=length).collect();
                return match frame.split_first() {
                    Some((&STX, text)) => Ok(String::from_utf8_lossy(&text[..text.len() - 1]).into_owned()),
                    _ => Err(format!("a telegram does not start with STX: {frame:02x?}")),
                };
            }
            let piece = self.pieces.recv_timeout(end.saturating_duration_since(Instant::now()));
            self.received
                .extend(piece.map_err(|_| format!("no whole telegram within {} s", PATIENCE.as_secs()))?);
        }
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
