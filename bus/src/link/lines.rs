//! Lines of text: what a controller without CAN speaks on a serial line or over TCP. Each line is one message of docs/rowscan.dbc by its names, or one
//! of five short forms for the sprayer.

use std::fmt::Write as _;

use rowscan_protocol::time::SimTime;

use super::dialect::Dialect;
use crate::message::Message;
use crate::pgn::MESSAGES;
use crate::pgn::sprayer::{LAST_NOZZLE, NOZZLE_DUTY, SECTION_DUTIES, SECTIONS, SPRAYER_CONTROL};
use crate::port_event::{PortEvent, Refused};
use crate::{CanFrame, J1939Id};

/// No line is longer.
const LONGEST: usize = 256;
/// Bytes of a message that one frame carries.
const FRAME: usize = 8;
/// The last section that has a place in a message.
const LAST_SECTION: usize = SECTION_DUTIES.len() * SECTIONS;
/// Digits behind the point that no signal's step goes beyond.
const DIGITS: usize = 7;

/// One client's lines.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    line: Vec<u8>,
    is_overlong: bool,
}

impl Dialect for Lines {
    const SERVER: &'static str = "a server of lines";
    const OPEN_AT_ONCE: bool = true;

    fn take(&mut self, bytes: &[u8], answers: &mut Vec<u8>, heard: &mut Vec<PortEvent>) {
        for &byte in bytes {
            match byte {
                b'\n' | b'\r' => self.end(answers, heard),
                _ if self.line.len() < LONGEST => self.line.push(byte),
                _ => self.is_overlong = true,
            }
        }
    }

    fn tell(&self, _at: SimTime, frame: &CanFrame, out: &mut Vec<u8>) {
        let known =
            J1939Id::of(frame.id).and_then(|id| MESSAGES.iter().find(|message| message.pgn == id.pgn));
        if let Some(message) = known.filter(|message| message.period_ms.is_some() && is_whole(message)) {
            out.extend_from_slice(line(message, frame.data()).as_bytes());
        }
    }
}

impl Lines {
    /// The line that has gathered is whole: commands are heard, and only what is wrong is answered.
    fn end(&mut self, answers: &mut Vec<u8>, heard: &mut Vec<PortEvent>) {
        let line = std::mem::take(&mut self.line);
        let frames = match (std::mem::take(&mut self.is_overlong), std::str::from_utf8(&line)) {
            (true, _) => Err(format!("expected a line of {LONGEST} bytes at most, found a longer one")),
            (false, Err(_)) => Err("expected text, found bytes that are none".to_owned()),
            (false, Ok(text)) => frames(text),
        };
        match frames {
            Ok(frames) => heard.extend(frames.into_iter().map(PortEvent::Frame)),
            Err(why) => {
                answers.extend_from_slice(format!("? {why}\n").as_bytes());
                heard.push(PortEvent::Refused(Refused::of(
                    &line,
                    "no line that this port takes, as its answer says",
                )));
            }
        }
        self.line = line;
        self.line.clear();
    }
}

/// True of what goes in one frame.
fn is_whole(message: &Message) -> bool {
    message.len <= FRAME
}

/// `MESSAGE SIGNAL=VALUE …`: what is not available is left out.
fn line(message: &Message, data: &[u8]) -> String {
    let mut line = message.name.to_owned();
    for (signal, value) in message.signals.iter().zip(message.decode(data)) {
        if let Some(value) = value {
            // Writing to memory cannot fail.
            let _ = write!(line, " {}={}", signal.name, digits(value));
        }
    }
    line.push('\n');
    line
}

/// What a line commands; nothing where it is blank.
fn frames(text: &str) -> Result<Vec<CanFrame>, String> {
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    match words.as_slice() {
        [] => Ok(Vec::new()),
        ["S", states] => sections(states),
        ["D", number, percent] => {
            let place = whole(number, (1, LAST_SECTION))? - 1;
            duty(place, number_of(percent)?)
        }
        ["N", number, percent] => {
            let first = Some(whole(number, (0, LAST_NOZZLE))? as f64);
            Ok(vec![frame(&NOZZLE_DUTY, &[first, Some(number_of(percent)?)])?])
        }
        ["R", percent] => Ok(vec![frame(&SPRAYER_CONTROL, &[Some(number_of(percent)?)])?]),
        ["L", litres] => Ok(vec![frame(&SPRAYER_CONTROL, &[None, Some(number_of(litres)?)])?]),
        [name, signals @ ..] => {
            let known = MESSAGES.iter().find(|message| message.name == *name && is_whole(message));
            let message = known.ok_or_else(|| {
                format!(
                    "expected S STATES, D SECTION PERCENT, N NOZZLE PERCENT, R PERCENT, L LITRES or MESSAGE SIGNAL=VALUE, found `{}`",
                    shown(text)
                )
            })?;
            Ok(vec![frame(message, &values(message, signals)?)?])
        }
    }
}

/// `S 0101`: section 1 first; 0 is shut, 1 open, and - leaves one as it is.
fn sections(states: &str) -> Result<Vec<CanFrame>, String> {
    let wrong = || format!("expected 1 to {LAST_SECTION} of 0, 1 and - after S, found `{}`", shown(states));
    let duties: Option<Vec<Option<f64>>> = states
        .chars()
        .map(|state| match state {
            '0' => Some(Some(0.0)),
            '1' => Some(Some(100.0)),
            '-' => Some(None),
            _ => None,
        })
        .collect();
    let duties = duties.filter(|duties| duties.len() <= LAST_SECTION).ok_or_else(wrong)?;
    let told = duties.chunks(SECTIONS).zip(SECTION_DUTIES);
    let told = told.filter(|(duties, _)| duties.iter().any(Option::is_some));
    told.map(|(duties, (_, message))| frame(message, duties)).collect()
}

/// The duty of the section at this place, from 0.
fn duty(place: usize, percent: f64) -> Result<Vec<CanFrame>, String> {
    let mut duties = [None; SECTIONS];
    let (message, own) = (SECTION_DUTIES.get(place / SECTIONS), duties.get_mut(place % SECTIONS));
    let Some(((_, message), own)) = message.zip(own) else { return Ok(Vec::new()) };
    *own = Some(percent);
    Ok(vec![frame(message, &duties)?])
}

/// The values of `SIGNAL=VALUE …`, in the order of the message's signals.
fn values(message: &Message, words: &[&str]) -> Result<Vec<Option<f64>>, String> {
    let mut values = vec![None; message.signals.len()];
    for word in words {
        let (name, value) = word.split_once('=').ok_or_else(|| {
            format!("expected SIGNAL=VALUE after {}, found `{}`", message.name, shown(word))
        })?;
        let place = message.signals.iter().position(|signal| signal.name == name).ok_or_else(|| {
            let names: Vec<&str> = message.signals.iter().map(|signal| signal.name).collect();
            format!("{} has no signal `{}`; it has {}", message.name, shown(name), names.join(", "))
        })?;
        if let Some(own) = values.get_mut(place) {
            *own = Some(number_of(value)?);
        }
    }
    Ok(values)
}

/// A message as a frame from its usual address; what is beyond a signal's range is no value of it.
fn frame(message: &Message, values: &[Option<f64>]) -> Result<CanFrame, String> {
    for (signal, value) in message.signals.iter().zip(values) {
        let value = value.filter(|value| !signal.can_say(*value));
        if let Some(value) = value {
            let of = |raw: i128| digits(raw as f64 * signal.scale + signal.offset);
            let (low, high) = (of(signal.raw_min()), of(signal.raw_max()));
            let unit = if signal.unit.is_empty() { String::new() } else { format!(" {}", signal.unit) };
            return Err(format!("expected {low} to {high}{unit} for {}, found {value}", signal.name));
        }
    }
    for (signal, value) in message.signals.iter().zip(values) {
        // A valve that is to open a little must not be told to shut.
        if let Some(value) = value.filter(|value| signal.unit == "%" && signal.rounds_to_none(*value)) {
            let step = digits(signal.scale);
            return Err(format!(
                "expected 0 or {step} % and more for {}, whose step is {step} %, found {value}, which would be 0",
                signal.name
            ));
        }
    }
    CanFrame::new(message.id(message.source).id(), message.encode(values).bytes())
        .ok_or_else(|| format!("{} does not fit into one frame", message.name))
}

/// A number without zeros that say nothing.
fn digits(value: f64) -> String {
    format!("{value:.DIGITS$}").trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn number_of(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("expected a number, found `{}`", shown(text)))
}

fn whole(text: &str, (low, high): (usize, usize)) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| (low..=high).contains(number));
    number.ok_or_else(|| format!("expected a number from {low} to {high}, found `{}`", shown(text)))
}

/// A client's words as they may stand in an answer: short, and without control characters.
fn shown(text: &str) -> String {
    text.escape_default().take(60).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::Signal;
    use crate::pgn::sprayer::{FLOW_METER, SPRAYER_STATE, nozzle_duties, section_duties, sprayer_control};
    use crate::pgn::tractor::SPEED_COMMAND;

    fn told(lines: &str) -> (String, Vec<CanFrame>) {
        let (mut answers, mut heard) = (Vec::new(), Vec::new());
        Lines::default().take(lines.as_bytes(), &mut answers, &mut heard);
        let frames = heard.iter().filter_map(|heard| match heard {
            PortEvent::Frame(frame) => Some(*frame),
            _ => None,
        });
        (String::from_utf8(answers).unwrap(), frames.collect())
    }

    fn only(line: &str) -> CanFrame {
        let (answers, frames) = told(line);
        assert_eq!((answers.as_str(), frames.len()), ("", 1), "{line}");
        frames[0]
    }

    fn sections(line: &str) -> Vec<(u16, f64)> {
        let (answers, frames) = told(line);
        assert_eq!(answers, "", "{line}");
        let duties = |frame: &CanFrame| section_duties(J1939Id::of(frame.id).unwrap().pgn, frame.data());
        frames.iter().flat_map(duties).collect()
    }

    #[test]
    fn short_forms_are_the_messages_that_they_stand_for() {
        assert_eq!(sections("S 01-1\n"), [(1, 0.0), (2, 1.0), (4, 1.0)]);
        assert_eq!(sections("S --------10\r\n"), [(9, 1.0), (10, 0.0)]);
        assert_eq!(sections("S 1------------0--\n\n"), [(1, 1.0), (14, 0.0)]);
        assert_eq!(sections(" D  3 62\n"), [(3, 0.62)]);
        assert_eq!(sections("D 16 0.4\nD 16 0.3\nD 16 0\n"), [(16, 0.004), (16, 0.004), (16, 0.0)]);
        assert_eq!(sections("S 1"), [], "a line ends with its end");
        assert_eq!(nozzle_duties(only("N 9 50\n").data()).collect::<Vec<_>>(), [(9, 0.5)]);
        assert_eq!(sprayer_control(only("R 40\n").data()), (Some(0.4), None));
        assert_eq!(sprayer_control(only("L 12.345\n").data()), (None, Some(12.345)));
        // By name, as every other message.
        let speed = SPEED_COMMAND.encode(&[Some(1.5)]);
        assert_eq!(only("MachineSelectedSpeedCommand CommandedSpeed=1.5\n").data(), speed.bytes());
    }

    #[test]
    fn every_message_that_is_told_is_a_line_and_a_line_is_its_message() {
        let mut seen = 0;
        for message in MESSAGES {
            for share in [0.0, 0.31, 1.0] {
                let raw = |signal: &Signal| {
                    let (low, high) = (signal.raw_min(), signal.raw_max());
                    low + ((high - low) as f64 * share) as i128
                };
                let value = |signal| Some(raw(signal) as f64 * signal.scale + signal.offset);
                let values: Vec<Option<f64>> = message.signals.iter().map(value).collect();
                let payload = message.encode(&values);
                let Some(frame) = CanFrame::new(message.id(0x90).id(), payload.bytes()) else { continue };
                let mut line = Vec::new();
                Lines::default().tell(SimTime::ZERO, &frame, &mut line);
                assert_eq!(line.is_empty(), message.period_ms.is_none(), "{}", message.name);
                if line.is_empty() {
                    continue;
                }
                seen += 1;
                let line = String::from_utf8(line).unwrap();
                assert_eq!(only(&line).data(), payload.bytes(), "{line}");
            }
        }
        assert!(seen >= 30, "{seen}");
    }

    #[test]
    fn what_is_not_available_is_left_out() {
        let told = |message: &Message, values: &[Option<f64>]| line(message, message.encode(values).bytes());
        assert_eq!(told(&FLOW_METER, &[Some(300.0), Some(12.5)]), "FlowMeter Pulses=300 PulseRate=12.5\n");
        let state =
            told(&SPRAYER_STATE, &[Some(3.02), None, Some(120.0), None, Some(1.0), Some(0.0), Some(0.0)]);
        assert_eq!(state, "SprayerState Pressure=3.02 Tank=120 MasterSwitch=1 HeldShut=0 TankEmpty=0\n");
    }

    #[test]
    fn wrong_lines_are_answered_with_what_was_expected_and_command_nothing() {
        for (line, expected) in [
            (
                "Q 1",
                "expected S STATES, D SECTION PERCENT, N NOZZLE PERCENT, R PERCENT, L LITRES or MESSAGE SIGNAL=VALUE, found `Q 1`",
            ),
            ("S 012", "expected 1 to 16 of 0, 1 and - after S, found `012`"),
            ("S 11111111111111111", "expected 1 to 16 of 0, 1 and - after S, found `11111111111111111`"),
            ("D 17 5", "expected a number from 1 to 16, found `17`"),
            ("D 3 101", "expected 0 to 100 % for Section3, found 101"),
            (
                "D 3 0.1",
                "expected 0 or 0.4 % and more for Section3, whose step is 0.4 %, found 0.1, which would be 0",
            ),
            ("N 251 5", "expected a number from 0 to 250, found `251`"),
            ("N 0 nan", "expected a number, found `nan`"),
            ("R -1", "expected 0 to 100 % for RegulatorOpening, found -1"),
            ("FlowMeter Flow=1", "FlowMeter has no signal `Flow`; it has Pulses, PulseRate"),
            ("FlowMeter 5", "expected SIGNAL=VALUE after FlowMeter, found `5`"),
            ("D 3\u{7} 5", "expected a number from 1 to 16, found `3\\u{7}`"),
        ] {
            assert_eq!(told(&format!("{line}\n")), (format!("? {expected}\n"), Vec::new()), "{line}");
        }
        let (answers, frames) = told(&format!("{}\nS 1\n", "S".repeat(1_000_000)));
        assert_eq!(answers, "? expected a line of 256 bytes at most, found a longer one\n");
        assert_eq!(frames.len(), 1, "the next line is heard");
    }
}
