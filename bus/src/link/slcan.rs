//! A Lawicel adapter (CAN232, CANUSB and their like): what python-can's `slcan` and Linux's `slcand` speak.

use std::io::Write as _;

use rowscan_protocol::can;
use rowscan_protocol::time::SimTime;

mod acceptance;

use self::acceptance::Acceptance;
use super::dialect::Dialect;
use crate::error_frame::ErrorFrame;
use crate::port_event::{BusLoss, PortEvent, Refused};
use crate::{CanFrame, CanId};

/// No command is longer: a 29-bit frame with eight bytes and a time stamp.
const LONGEST: usize = 32;
/// The command done.
const OK: u8 = b'\r';
/// The command refused.
const REFUSED: u8 = 0x07;
/// S5: 250 kbit/s, what the machine's bus runs at.
const OUR_RATE: u8 = b'5';
/// Status: error warning, error passive, bus error. What a chip at the wrong rate comes to.
const BUS_OFF: u8 = WARNING | PASSIVE | BUS_ERROR;
const WARNING: u8 = 0x04;
const PASSIVE: u8 = 0x20;
const BUS_ERROR: u8 = 0x80;

/// The adapter's state.
#[derive(Clone, Debug, Default)]
pub struct Adapter {
    line: Vec<u8>,
    overlong: bool,
    open: bool,
    listen_only: bool,
    /// The rate set with S or s is not the bus's.
    wrong_rate: bool,
    time_stamps: bool,
    auto_poll_off: bool,
    /// What the controller has told of its errors, as the bits of `F`.
    errors: u8,
    acceptance: Acceptance,
}

impl Adapter {
    /// Whether the channel is open.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Takes bytes from the host; appends the adapter's answers and what comes of them.
    pub fn handle_bytes(&mut self, bytes: &[u8], answers: &mut Vec<u8>, heard: &mut Vec<PortEvent>) {
        for &byte in bytes {
            match byte {
                b'\r' => {
                    let line = std::mem::take(&mut self.line);
                    let sound = !std::mem::take(&mut self.overlong);
                    // A lone end of line, as hosts send to clear the adapter, is no command.
                    if !line.is_empty() || !sound {
                        let answered = if sound { self.command(&line, answers, heard) } else { None };
                        answers.push(if answered.is_some() { OK } else { REFUSED });
                    }
                    self.line = line;
                    self.line.clear();
                }
                b'\n' => {}
                _ if self.line.len() < LONGEST => self.line.push(byte),
                _ => self.overlong = true,
            }
        }
    }

    /// Appends a frame from the bus, as the host shall see it; nothing while the channel is closed, or if the filters keep it out.
    pub fn frame(&self, at: SimTime, frame: &CanFrame, out: &mut Vec<u8>) {
        if !self.open || self.wrong_rate || !self.acceptance.takes(frame) {
            return;
        }
        // Writing to memory cannot fail.
        let _ = match (frame.id, frame.remote) {
            (CanId::Standard(id), false) => write!(out, "t{id:03X}{}", frame.len()),
            (CanId::Standard(id), true) => write!(out, "r{id:03X}{}", frame.len()),
            (CanId::Extended(id), false) => write!(out, "T{id:08X}{}", frame.len()),
            (CanId::Extended(id), true) => write!(out, "R{id:08X}{}", frame.len()),
        };
        for byte in frame.data() {
            let _ = write!(out, "{byte:02X}");
        }
        if self.time_stamps {
            // Milliseconds within a minute.
            let _ = write!(out, "{:04X}", at.0 / 1_000_000 % 60_000);
        }
        out.push(b'\r');
    }

    /// One command; `None` if it is refused.
    fn command(&mut self, line: &[u8], answers: &mut Vec<u8>, heard: &mut Vec<PortEvent>) -> Option<()> {
        let (&name, rest) = line.split_first()?;
        let closed = |open: bool| (!open).then_some(());
        match (name, rest) {
            (b'S', &[rate @ b'0'..=b'8']) => {
                closed(self.open)?;
                self.wrong_rate = rate != OUR_RATE;
            }
            // Bit timing registers of another clock: nobody can say which rate that is, so it is taken for right.
            (b's', timing) if timing.len() == 4 || timing.len() == 6 => {
                closed(self.open)?;
                self.wrong_rate = false;
            }
            (b'O' | b'L', []) => {
                closed(self.open)?;
                self.open = true;
                self.listen_only = name == b'L';
                heard.push(if self.wrong_rate {
                    PortEvent::Lost(BusLoss::WrongRate)
                } else {
                    PortEvent::Opened
                });
            }
            (b'C', []) => self.open = false,
            (b't' | b'T' | b'r' | b'R', _) => {
                // A wrong rate is told already.
                if self.wrong_rate {
                    return None;
                }
                // Hosts try commands that adapters do not have, and go by the answer: frames alone are missed.
                let mut refuse = |why| heard.push(PortEvent::Refused(Refused::of(line, why)));
                let Some(frame) = parse_frame(name, rest) else {
                    refuse("no frame in slcan's form");
                    return None;
                };
                if !self.open || self.listen_only {
                    refuse("the channel is not open for sending (`O`)");
                    return None;
                }
                heard.push(PortEvent::Frame(frame));
                if !self.auto_poll_off {
                    answers.push(if frame.id.is_extended() { b'Z' } else { b'z' });
                }
            }
            (b'F', []) => {
                self.open.then_some(())?;
                let status = self.errors | if self.wrong_rate { BUS_OFF } else { 0 };
                // Reading it clears it, but for a state that lasts.
                self.errors &= !BUS_ERROR;
                answers.extend_from_slice(format!("F{status:02X}").as_bytes());
            }
            (b'Z', &[on @ (b'0' | b'1')]) => {
                closed(self.open)?;
                self.time_stamps = on == b'1';
            }
            (b'X', &[on @ (b'0' | b'1')]) => self.auto_poll_off = on == b'0',
            // Everything is delivered at once, so there is never a frame to poll for.
            (b'P', []) => self.open.then_some(())?,
            (b'A', []) => {
                self.open.then_some(())?;
                answers.push(b'A');
            }
            (b'V', []) => answers.extend_from_slice(b"V1013"),
            (b'N', []) => answers.extend_from_slice(b"NR001"),
            (b'M' | b'm', digits) if digits.len() == 8 => {
                closed(self.open)?;
                let digits = std::str::from_utf8(digits).ok()?;
                let register = u32::from_str_radix(digits, 16).ok()?.to_be_bytes();
                match name {
                    b'M' => self.acceptance.code = register,
                    _ => self.acceptance.mask = register,
                }
            }
            (b'W', &[mode @ (b'0' | b'1')]) => {
                closed(self.open)?;
                self.acceptance.single = mode == b'1';
            }
            // Auto start and the line's own rate: taken, and nothing comes of them.
            (b'Q', &[b'0'..=b'2']) | (b'U', &[b'0'..=b'6']) => {}
            _ => return None,
        }
        Some(())
    }
}

/// The frame of a transmit command's name and the rest of its line.
fn parse_frame(name: u8, rest: &[u8]) -> Option<CanFrame> {
    let text = std::str::from_utf8(rest).ok().filter(|text| text.is_ascii())?;
    let extended = name.is_ascii_uppercase();
    let digits = if extended { 8 } else { 3 };
    let id = text.get(..digits).filter(|id| id.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let id = CanId::new(u32::from_str_radix(id, 16).ok()?, extended)?;
    let len: u8 = text.get(digits..=digits)?.parse().ok()?;
    let data = text.get(digits + 1..)?;
    if name.eq_ignore_ascii_case(&b'r') {
        return CanFrame::remote(id, len).filter(|_| data.is_empty());
    }
    let data = can::hex(data)?;
    CanFrame::new(id, &data).filter(|frame| frame.len() == len)
}

impl Dialect for Adapter {
    const SERVER: &'static str = "an slcan adapter";

    fn take(&mut self, bytes: &[u8], answers: &mut Vec<u8>, heard: &mut Vec<PortEvent>) {
        self.handle_bytes(bytes, answers, heard);
    }

    fn tell(&self, at: SimTime, frame: &CanFrame, out: &mut Vec<u8>) {
        self.frame(at, frame, out);
    }

    /// The host reads it with `F`.
    fn error(&mut self, error: &ErrorFrame) {
        self.errors = match error.is_off() {
            Some(true) => BUS_OFF,
            Some(false) => 0,
            None => match error.state() {
                Some(state) => {
                    let bit = |on: bool, bit: u8| if on { bit } else { 0 };
                    bit(state.warns, WARNING) | bit(state.is_passive, PASSIVE)
                }
                None => self.errors | BUS_ERROR,
            },
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(adapter: &mut Adapter, commands: &str) -> (String, Vec<PortEvent>) {
        let (mut answers, mut heard) = (Vec::new(), Vec::new());
        adapter.handle_bytes(commands.as_bytes(), &mut answers, &mut heard);
        (String::from_utf8(answers).unwrap(), heard)
    }

    #[test]
    fn it_opens_sends_and_receives_as_python_can_asks() {
        let mut adapter = Adapter::default();
        assert_eq!(told(&mut adapter, "C\rS5\rO\r"), ("\r\r\r".into(), vec![PortEvent::Opened]));
        let frame = CanFrame::new(CanId::new(0x18EA_FFFE, true).unwrap(), &[0x00, 0xEE, 0x00]).unwrap();
        assert_eq!(told(&mut adapter, "T18EAFFFE300EE00\r"), ("Z\r".into(), vec![PortEvent::Frame(frame)]));
        let mut out = Vec::new();
        adapter.frame(SimTime(61_234_000_000), &frame, &mut out);
        assert_eq!(out, b"T18EAFFFE300EE00\r");
        assert_eq!(told(&mut adapter, "t1232AABB\r").0, "z\r");
        assert_eq!(told(&mut adapter, "V\rN\rF\r").0, "V1013\rNR001\rF00\r");
        told(&mut adapter, "C\rZ1\rO\r");
        out.clear();
        adapter.frame(SimTime(61_234_000_000), &frame, &mut out);
        assert_eq!(out, b"T18EAFFFE300EE0004D2\r", "1234 ms into its minute");
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let mut adapter = Adapter::default();
        for wrong in
            ["T18EAFFFE1\r", "O\rO\r", "S5\r", "T18EAFFFE9\r", "?\r", "t12\r", "T1FFFFFFFG0\r", "t8000\r"]
        {
            let (answers, _) = told(&mut adapter, wrong);
            assert!(answers.ends_with('\u{7}'), "{wrong}: {answers:?}");
        }
        let long = "T".repeat(500) + "\r";
        assert_eq!(told(&mut adapter, &long).0, "\u{7}");
        assert_eq!(
            told(&mut adapter, "\r\r\rV\r").0,
            "V1013\r",
            "line ends that clear the adapter are no commands"
        );
    }

    #[test]
    fn at_the_wrong_rate_it_is_off_the_bus_and_says_so() {
        let mut adapter = Adapter::default();
        let (answers, heard) = told(&mut adapter, "S6\rO\rF\rt1230\r");
        assert_eq!((answers.as_str(), heard), ("\r\rFA4\r\u{7}", vec![PortEvent::Lost(BusLoss::WrongRate)]));
        let mut out = Vec::new();
        adapter.frame(SimTime::ZERO, &CanFrame::remote(CanId::Standard(1), 0).unwrap(), &mut out);
        assert!(out.is_empty());
    }

    #[test]
    fn a_host_that_sets_code_and_mask_hears_what_they_let_through() {
        let (wheel, ground, other) = (0x18FE_48F0, 0x18FE_49F0, 0x18FF_1080);
        let heard = |setup: &str| -> Vec<u32> {
            let mut adapter = Adapter::default();
            let answers = told(&mut adapter, &format!("S5\r{setup}O\r")).0;
            assert!(!answers.contains('\u{7}'), "{answers:?}");
            let mut let_through = Vec::new();
            for id in [wheel, ground, other] {
                let mut out = Vec::new();
                let frame = CanFrame::new(CanId::new(id, true).unwrap(), &[]).unwrap();
                adapter.frame(SimTime::ZERO, &frame, &mut out);
                let_through.extend((!out.is_empty()).then_some(id));
            }
            let_through
        };
        assert_eq!(heard(""), [wheel, ground, other]);
        // Both filters on PGNs FExx: bits 28 to 13 of the identifier, which dual filters compare of a long one.
        assert_eq!(heard("MC7F0C7F0\rm00070007\r"), [wheel, ground]);
        assert_eq!(heard("MC7F24780\rm00000007\rW1\r"), [wheel], "a single filter sees all 29 bits");
        let mut adapter = Adapter::default();
        assert_eq!(told(&mut adapter, "S5\rO\rM00000000\rm0000000g\rW1\r").0, "\r\r\u{7}\u{7}\u{7}");
    }

    #[test]
    fn a_listener_does_not_send() {
        let mut adapter = Adapter::default();
        assert_eq!(told(&mut adapter, "L\rt1230\r").0, "\r\u{7}");
    }
}
