//! A socketcand server: CAN over TCP in angle brackets, raw mode. What python-can's `socketcand` speaks.

use std::fmt::Write as _;
use std::net::SocketAddr;
use std::time::Duration;

use rowscan_ports::clock::{Stopwatch, rest};
use rowscan_ports::in_flight::Pending;
use rowscan_ports::task;
use rowscan_ports::{Tally, acknowledge_at_once, keep_alive};
use rowscan_protocol::time::SimTime;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::{BusError, PortListener};
use crate::port_event::{OutgoingFrame, PortEvent};
use crate::{CanFrame, CanId};

/// Clients served at once.
const MAX_CLIENTS: usize = 16;
/// Frames a client may be behind before it loses some.
const QUEUE: usize = 4096;
/// How long a client that has opened the bus gets no frames, host time.
const QUIET: Duration = Duration::from_millis(50);
/// No element is longer.
const LONGEST: usize = 128;

/// One client's conversation.
#[derive(Clone, Debug, Default)]
pub struct Conversation {
    element: Vec<u8>,
    inside: bool,
    opened: bool,
    raw: bool,
}

impl Conversation {
    /// What the server says first.
    pub const GREETING: &'static str = "< hi >";

    /// Takes bytes from the client; appends the answers and what comes of them.
    pub fn handle_bytes(&mut self, bytes: &[u8], answers: &mut String, heard: &mut Vec<PortEvent>) {
        for &byte in bytes {
            match byte {
                b'<' => {
                    self.inside = true;
                    self.element.clear();
                }
                b'>' if self.inside => {
                    self.inside = false;
                    let element = std::mem::take(&mut self.element);
                    let text = String::from_utf8_lossy(&element);
                    self.element_in(&text, answers, heard);
                }
                _ if self.inside && self.element.len() < LONGEST => self.element.push(byte),
                _ if self.inside => {
                    self.inside = false;
                    answers.push_str("< error element too long >");
                }
                _ => {}
            }
        }
    }

    fn element_in(&mut self, text: &str, answers: &mut String, heard: &mut Vec<PortEvent>) {
        let mut words = text.split_whitespace();
        match words.next() {
            Some("open") if !self.opened => {
                self.opened = true;
                answers.push_str("< ok >");
            }
            Some("rawmode") if self.opened => {
                self.raw = true;
                answers.push_str("< ok >");
                heard.push(PortEvent::Opened);
            }
            Some("echo") => answers.push_str("< echo >"),
            Some("send") if self.raw => match sent(words) {
                Some(frame) => heard.push(PortEvent::Frame(frame)),
                None => answers.push_str("< error could not parse frame >"),
            },
            Some("open" | "rawmode" | "send") => answers.push_str("< error not in this state >"),
            _ => answers.push_str("< error unknown command >"),
        }
    }

    /// Appends a frame from the bus; nothing before raw mode. Remote frames have no form in this protocol.
    pub fn frame(&self, at: SimTime, frame: &CanFrame, out: &mut String) {
        if !self.raw || frame.remote {
            return;
        }
        let (seconds, micros) = (at.0 / 1_000_000_000, at.0 / 1000 % 1_000_000);
        let _ = match frame.id {
            CanId::Standard(id) => write!(out, "< frame {id:03X} {seconds}.{micros:06} "),
            CanId::Extended(id) => write!(out, "< frame {id:08X} {seconds}.{micros:06} "),
        };
        for byte in frame.data() {
            let _ = write!(out, "{byte:02X}");
        }
        out.push_str(" >");
    }
}

/// `123 2 AA BB`: identifier (eight digits: 29 bits), length, bytes.
fn sent<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<CanFrame> {
    let id = words.next().filter(|id| (1..=8).contains(&id.len()))?;
    let id = CanId::new(u32::from_str_radix(id, 16).ok()?, id.len() > 3)?;
    let len = u8::from_str_radix(words.next()?, 16).ok()?;
    let mut data = Vec::with_capacity(8);
    for word in words.take(9) {
        data.push(u8::from_str_radix(word, 16).ok()?);
    }
    CanFrame::new(id, &data).filter(|frame| frame.len() == len)
}

/// A listening server.
#[derive(Debug)]
pub struct SocketcandLink {
    listener: TcpListener,
    address: SocketAddr,
}

impl SocketcandLink {
    pub(super) async fn open(place: &str) -> Result<Self, BusError> {
        let failed =
            |cause| BusError::Network { what: "a socketcand server", address: place.to_owned(), cause };
        let listener = TcpListener::bind(place).await.map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        Ok(Self { listener, address })
    }

    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    pub(super) async fn run(self, mut queue: mpsc::Receiver<OutgoingFrame>, ear: PortListener) {
        let mut clients: Vec<(u64, mpsc::Sender<OutgoingFrame>)> = Vec::new();
        let mut numbers = 0..u64::MAX;
        let (mut tasks, refused) = (JoinSet::new(), Tally::default());
        loop {
            tokio::select! {
                accepted = self.listener.accept() => {
                    clients.retain(|(_, client)| !client.is_closed());
                    match accepted {
                        Ok((stream, _)) if clients.len() < MAX_CLIENTS => {
                            let (outbox, queue) = mpsc::channel(QUEUE);
                            let number = numbers.next().unwrap_or_default();
                            clients.push((number, outbox));
                            tasks.spawn(task(serve(stream, queue, ear.of_client(number))));
                        }
                        Ok((_, client)) => {
                            if let Some(so_far) = refused.count() {
                                tracing::warn!("{client} is refused: {MAX_CLIENTS} clients are on the CAN bus already ({so_far} so far)");
                            }
                        }
                        Err(_) => rowscan_ports::clock::retry_pause().await,
                    }
                }
                frame = queue.recv() => {
                    let Some(outgoing) = frame else { return };
                    // A client that is behind loses frames, alone, and holds nobody up.
                    clients.retain(|(number, client)| {
                        outgoing.said_by == Some(*number)
                            || !matches!(client.try_send(outgoing.clone()), Err(mpsc::error::TrySendError::Closed(_)))
                    });
                }
                Some(_) = tasks.join_next() => {}
            }
        }
    }
}

async fn serve(mut stream: TcpStream, mut queue: mpsc::Receiver<OutgoingFrame>, ear: PortListener) {
    let _ = keep_alive(&stream);
    let (mut reader, mut writer) = stream.split();
    let mut conversation = Conversation::default();
    let (mut bytes, mut answers, mut heard) = ([0; 512], String::from(Conversation::GREETING), Vec::new());
    // The frame in `answers`, until it is written.
    let mut written: Option<Pending> = None;
    // python-can takes whatever comes with the answer to its opening for a part of it: frames for it wait a moment, and its own do not.
    let mut opened: Option<Stopwatch> = None;
    loop {
        if writer.write_all(answers.as_bytes()).await.is_err() {
            return;
        }
        answers.clear();
        drop(written.take());
        for heard in heard.drain(..) {
            if heard == PortEvent::Opened {
                opened = Some(Stopwatch::start());
            }
            ear.hear(heard).await;
        }
        let quiet = opened.map_or(Duration::ZERO, |opened| QUIET.saturating_sub(opened.elapsed()));
        tokio::select! {
            read = reader.read(&mut bytes) => match read {
                Ok(0) | Err(_) => return,
                Ok(count) => {
                    let _ = acknowledge_at_once(reader.as_ref());
                    let bytes = bytes.get(..count).unwrap_or_default();
                    conversation.handle_bytes(bytes, &mut answers, &mut heard);
                }
            },
            () = rest(quiet), if !quiet.is_zero() => {}
            frame = queue.recv(), if quiet.is_zero() => {
                let Some(OutgoingFrame { at, what, pending, .. }) = frame else { return };
                written = Some(pending);
                // A server tells errors only if it was started to (`-e`).
                if let Some(frame) = what.frame() {
                    conversation.frame(at, frame, &mut answers);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raw_mode_is_reached_as_python_can_asks() {
        let mut conversation = Conversation::default();
        let (mut answers, mut heard) = (String::new(), Vec::new());
        let frame = CanFrame::new(CanId::new(0x18FE_4980, true).unwrap(), &[1, 0xFF]).unwrap();
        conversation.frame(SimTime::ZERO, &frame, &mut answers);
        assert_eq!(answers, "", "nothing before raw mode");
        conversation.handle_bytes(b"< open can0 >< raw", &mut answers, &mut heard);
        conversation.handle_bytes(b"mode >< send 18FE4980 2 01 FF >", &mut answers, &mut heard);
        assert_eq!(answers, "< ok >< ok >");
        assert_eq!(heard, [PortEvent::Opened, PortEvent::Frame(frame)]);
        answers.clear();
        conversation.frame(SimTime(1_500_001_000), &frame, &mut answers);
        assert_eq!(answers, "< frame 18FE4980 1.500001 01FF >");
    }

    #[test]
    fn nonsense_is_answered_with_an_error_and_bounded() {
        let mut conversation = Conversation::default();
        let (mut answers, mut heard) = (String::new(), Vec::new());
        conversation.handle_bytes(b"< send 123 0 >< fly >", &mut answers, &mut heard);
        assert_eq!(answers, "< error not in this state >< error unknown command >");
        answers.clear();
        conversation.handle_bytes(&[b"<".as_slice(), &[b'x'; 1000]].concat(), &mut answers, &mut heard);
        assert_eq!(answers, "< error element too long >");
        answers.clear();
        conversation.handle_bytes(
            b"< open can0 >< rawmode >< send 123 2 01 >< send 1234567890 0 >",
            &mut answers,
            &mut heard,
        );
        assert_eq!(answers.matches("could not parse").count(), 2);
        assert_eq!(heard, [PortEvent::Opened]);
    }
}
