//! A socketcand server: CAN over TCP in angle brackets, raw mode. What python-can's `socketcand` speaks.

use std::fmt::Write as _;
use std::time::Duration;

use rowscan_protocol::time::SimTime;

use super::dialect::Dialect;
use crate::port_event::{PortEvent, Refused};
use crate::{CanFrame, CanId};

/// How long a client that has opened its bus hears no frames, host time: python-can takes whatever comes with the answer to its opening for a part of it. Its own
/// frames do not wait.
pub const QUIET: Duration = Duration::from_millis(50);
/// No element is longer.
const LONGEST: usize = 128;

/// Why what a client sent came to nothing.
const FORM: &str = "no frame in the form `< send ID LENGTH BYTES >`: 3 digits of identifier, or 8 of an extended one, and as many bytes as LENGTH says, apart by blanks";
const ORDER: &str = "not in this state: `< open can0 >` once, then `< rawmode >`, then frames";
const OVERLONG: &str = "an element of more than 128 bytes";
const BARE: &str = "outside of angle brackets, where nothing is read";

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
                    self.end_bare(heard);
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
                    heard.push(PortEvent::Refused(Refused::of(&self.element, OVERLONG)));
                    self.element.clear();
                }
                b'\n' => self.end_bare(heard),
                _ if !byte.is_ascii_whitespace() || !self.element.is_empty() => self.add_bare(byte, heard),
                _ => {}
            }
        }
    }

    /// Takes a byte outside of brackets.
    fn add_bare(&mut self, byte: u8, heard: &mut Vec<PortEvent>) {
        self.element.push(byte);
        if self.element.len() >= LONGEST {
            self.end_bare(heard);
        }
    }

    /// What stood outside of brackets is over.
    fn end_bare(&mut self, heard: &mut Vec<PortEvent>) {
        if !self.inside && !self.element.is_empty() {
            heard.push(PortEvent::Refused(Refused::of(self.element.trim_ascii(), BARE)));
            self.element.clear();
        }
    }

    fn element_in(&mut self, text: &str, answers: &mut String, heard: &mut Vec<PortEvent>) {
        let mut words = text.split_whitespace();
        let mut refuse = |answers: &mut String, answer: &str, why: &'static str| {
            // Writing to memory cannot fail.
            let _ = write!(answers, "< error {answer} >");
            heard.push(PortEvent::Refused(Refused::of(text.trim().as_bytes(), why)));
        };
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
                None => refuse(answers, "could not parse frame", FORM),
            },
            Some("open" | "rawmode" | "send") => refuse(answers, "not in this state", ORDER),
            _ => refuse(answers, "unknown command", "no command of a socketcand client in raw mode"),
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

impl Dialect for Conversation {
    const SERVER: &'static str = "a socketcand server";
    const GREETING: &'static str = Self::GREETING;
    const QUIET: Duration = QUIET;

    fn take(&mut self, bytes: &[u8], answers: &mut Vec<u8>, heard: &mut Vec<PortEvent>) {
        let mut text = String::new();
        self.handle_bytes(bytes, &mut text, heard);
        answers.extend_from_slice(text.as_bytes());
    }

    /// A server tells errors only if it was started to (`-e`): frames are all.
    fn tell(&self, at: SimTime, frame: &CanFrame, out: &mut Vec<u8>) {
        let mut text = String::new();
        self.frame(at, frame, &mut text);
        out.extend_from_slice(text.as_bytes());
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
        let refused = |text: &str, why| PortEvent::Refused(Refused::of(text.as_bytes(), why));
        conversation.handle_bytes(b"< send 123 0 >< fly >", &mut answers, &mut heard);
        assert_eq!(
            std::mem::take(&mut heard),
            [refused("send 123 0", ORDER), refused("fly", "no command of a socketcand client in raw mode"),]
        );
        assert_eq!(answers, "< error not in this state >< error unknown command >");
        answers.clear();
        conversation.handle_bytes(&[b"<".as_slice(), &[b'x'; 1000]].concat(), &mut answers, &mut heard);
        assert_eq!(answers, "< error element too long >");
        assert_eq!(heard.first(), Some(&refused(&"x".repeat(128), OVERLONG)));
        assert!(heard.len() > 1 && heard[1..].iter().all(|rest| *rest == refused(&"x".repeat(128), BARE)));
        answers.clear();
        conversation.handle_bytes(b"\r\n \n<", &mut answers, &mut Vec::new());
        heard.clear();
        conversation.handle_bytes(b" echo > \r\n", &mut answers, &mut heard);
        assert_eq!((std::mem::take(&mut answers), heard.len()), ("< echo >".to_owned(), 0));
        conversation.handle_bytes(b"send 123 1 00\n", &mut answers, &mut heard);
        assert_eq!(std::mem::take(&mut heard), [refused("send 123 1 00", BARE)]);
        conversation.handle_bytes(
            b"< open can0 >< rawmode >< send 123 2 01 >< send 1234567890 0 >",
            &mut answers,
            &mut heard,
        );
        assert_eq!(answers.matches("could not parse").count(), 2);
        let sent = [refused("send 123 2 01", FORM), refused("send 1234567890 0", FORM)];
        assert_eq!(heard, [PortEvent::Opened, sent[0], sent[1]]);
    }
}
