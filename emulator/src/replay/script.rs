//! What a recorded device answered: request by request, as often as it was asked.

use std::collections::HashMap;
use std::sync::Arc;

use rowscan_protocol::device::{Device, Reply, command};
use rowscan_protocol::frame::{Dialect, Frame, encode};
use rowscan_protocol::telegram::fr_echo_filter::EchoFilter;
use rowscan_protocol::telegram::lmd_scandatacfg::ScanDataConfig;
use rowscan_protocol::telegram::lmp_output_range::OutputRange;
use rowscan_protocol::telegram::{Kind, LmdScandata, SopasError, Telegram, Variable};
use rowscan_recording::{RecordedFrame, Side};

/// Requests that are kept; no start-up has more.
const MOST: usize = 4096;

/// Scans, and the settings that shape them.
const SHAPED: [&str; 4] = [LmdScandata::NAME, ScanDataConfig::NAME, OutputRange::NAME, EchoFilter::NAME];

/// A request's payload and how it was framed.
type Request = (Dialect, Vec<u8>);

/// A recorded conversation.
#[derive(Debug, Default)]
pub struct Script {
    answers: HashMap<Request, Vec<Vec<u8>>>,
    /// Replies that tell a variable's value, and writes that were accepted before the first scan, in the order they came.
    values: Vec<Request>,
    /// Requests without an answer so far.
    open: Vec<Request>,
    /// What was answered last.
    last: Option<Vec<u8>>,
    /// What the host sent was recorded too.
    both_sides: bool,
}

impl Script {
    /// Takes the next recorded frame that is no event. What is written after the first scan is no setting that scans were made with.
    pub(super) fn take(&mut self, frame: &RecordedFrame, is_before_scans: bool) {
        let (Some(dialect), Some(telegram)) = (frame.dialect, frame.telegram()) else { return };
        if self.answers.len() >= MOST {
            return;
        }
        if frame.from == Side::Host {
            self.both_sides = true;
            self.open.push((dialect, frame.payload().to_vec()));
            // Nobody keeps so many requests unanswered.
            if self.open.len() > 64 {
                self.open.remove(0);
            }
            return;
        }
        if telegram.kind == Kind::Ra {
            self.values.push((dialect, frame.payload().to_vec()));
        }
        let answers = |(of, request): &Request| {
            let name = Telegram::parse(*of, request).map(|request| request.name);
            telegram.kind == Kind::Fa || name == Ok(telegram.name)
        };
        let request = match self.open.iter().position(answers) {
            Some(0) => self.open.remove(0),
            // What was answered came twice, as some captures have it: nobody asked twice.
            _ if self.last.as_ref() == Some(&frame.bytes) => return,
            Some(skipped) => {
                self.open.drain(..skipped);
                self.open.remove(0)
            }
            // Without the host's side, a value still says what was asked.
            None if !self.both_sides && telegram.kind == Kind::Ra => {
                (dialect, format!("sRN {}", telegram.name).into_bytes())
            }
            None => return,
        };
        if telegram.kind == Kind::Wa && is_before_scans {
            self.values.push(request.clone());
        }
        self.answers.entry(request).or_default().push(frame.bytes.clone());
        self.last = Some(frame.bytes.clone());
    }

    /// The recorded values, by reply (`sRA`) or accepted write (`sWN`).
    pub fn values(&self) -> impl Iterator<Item = Telegram<'_>> {
        self.values.iter().filter_map(|(dialect, payload)| Telegram::parse(*dialect, payload).ok())
    }

    /// Requests with a recorded answer.
    pub fn len(&self) -> usize {
        self.answers.len()
    }

    /// True if nothing was asked.
    pub fn is_empty(&self) -> bool {
        self.answers.is_empty()
    }
}

/// Says a script's answers to one client.
#[derive(Debug)]
pub(crate) struct ScriptedReplies {
    script: Arc<Script>,
    /// How often each request has been answered on this connection.
    said: HashMap<Request, usize>,
}

impl ScriptedReplies {
    pub(crate) fn new(script: Arc<Script>) -> Self {
        Self { script, said: HashMap::new() }
    }

    /// Puts the recorded answer in the place of the device's own, and tells whether it did. What the device refuses for want of a login
    /// stays refused, and scans that are cut to measure are not the recorded ones.
    pub(crate) fn amend(&mut self, device: &Device, request: &Frame<'_>, reply: &mut Reply) -> bool {
        let name = Telegram::parse(request.dialect, request.payload).map_or("", |telegram| telegram.name);
        if SHAPED.contains(&name) && device.is_cut() {
            return false;
        }
        let key = (request.dialect, request.payload.to_vec());
        let Some(answers) = self.script.answers.get(&key) else { return false };
        let denied = [SopasError::MethodAccessDenied, SopasError::WriteAccessDenied];
        if refusal(request.dialect, &reply.bytes).is_some_and(|error| denied.contains(&error)) {
            return false;
        }
        // Once the recorded answers are used up, the device's own state is the truth of what changes by itself.
        let is_live = command::by_name(name).is_some_and(|command| command.is_live);
        let said = self.said.entry(key).or_default();
        let answer = match answers.get(*said) {
            None if is_live => return false,
            None => answers.last(),
            some => some,
        };
        *said += 1;
        // What was answered before another echo was set is not true of the scans that are played.
        let contradicts = |answer: &Vec<u8>| {
            name == EchoFilter::NAME && !says_the_same(request.dialect, &reply.bytes, answer)
        };
        let answer = answer.filter(|answer| !contradicts(answer));
        if let Some(answer) = answer {
            reply.bytes.clone_from(answer);
        }
        answer.is_some()
    }
}

/// The reason in a whole frame of `sFA`.
fn refusal(dialect: Dialect, frame: &[u8]) -> Option<SopasError> {
    telegram(dialect, frame)?.refusal()
}

/// The telegram in a whole frame.
fn telegram(dialect: Dialect, frame: &[u8]) -> Option<Telegram<'_>> {
    let mut empty = Vec::new();
    encode(dialect, b"", &mut empty);
    let payload = frame.get(empty.len() - 1..frame.len().checked_sub(1)?)?;
    Telegram::parse(dialect, payload).ok()
}

/// Whether two replies about FREchoFilter are of one kind and of one value, however they are written.
fn says_the_same(dialect: Dialect, one: &[u8], other: &[u8]) -> bool {
    let said = |frame| {
        let telegram: Telegram<'_> = telegram(dialect, frame)?;
        let value = (telegram.kind == Kind::Ra).then(|| telegram.args.decode::<EchoFilter>().ok());
        Some((telegram.kind, value))
    };
    said(one) == said(other)
}

/// Whether a request asks for the latest scan.
pub(crate) fn polls(request: &Frame<'_>) -> bool {
    Telegram::parse(request.dialect, request.payload)
        .is_ok_and(|telegram| telegram.kind == Kind::Rn && telegram.name == LmdScandata::NAME)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_recording::StreamKind;

    fn frame(from: Side, body: &str, at_ms: u64) -> RecordedFrame {
        let mut bytes = Vec::new();
        encode(Dialect::A, body.as_bytes(), &mut bytes);
        let at_ns = at_ms * 1_000_000;
        let (stream, frame_at, kind) = (0, 0, StreamKind::Cola);
        RecordedFrame { stream, kind, from, at_ns, bytes, frame_at, dialect: Some(Dialect::A) }
    }

    #[test]
    fn a_reply_that_was_recorded_twice_is_said_once() {
        let mut script = Script::default();
        for frame in [
            frame(Side::Host, "sRN SCdevicestate", 0),
            frame(Side::Device, "sRA SCdevicestate 1", 2),
            frame(Side::Device, "sRA SCdevicestate 1", 5),
            frame(Side::Host, "sRN SCdevicestate", 100),
            frame(Side::Device, "sRA SCdevicestate 1", 102),
            frame(Side::Host, "sRN DeviceIdent", 200),
            frame(Side::Device, "sRA SCdevicestate 1", 201),
            frame(Side::Device, "sRA DeviceIdent 1 A 1 B", 203),
        ] {
            script.take(&frame, true);
        }
        let said = |request: &str| script.answers[&(Dialect::A, request.as_bytes().to_vec())].clone();
        let once = frame(Side::Device, "sRA SCdevicestate 1", 0).bytes;
        assert_eq!(said("sRN SCdevicestate"), [once.clone(), once]);
        assert_eq!(said("sRN DeviceIdent"), [frame(Side::Device, "sRA DeviceIdent 1 A 1 B", 0).bytes]);
    }
}
