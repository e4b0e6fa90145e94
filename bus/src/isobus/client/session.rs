//! How a client comes to be connected: what it says next, and what it waits for.
//!
//! The order of the steps, their bytes and time-outs: AgIsoStack++, `isobus_task_controller_client.cpp`, `update` and `process_rx_message`.

use std::time::Duration;

use rowscan_protocol::time::SimTime;

use crate::isobus::pool::Version;
use crate::isobus::process_data::descriptor;

/// Before its first step, and until a task controller that says nothing is lost.
pub(super) const SILENCE: Duration = Duration::from_secs(6);
/// Without an answer for so long it begins anew.
pub(super) const ANSWER: Duration = Duration::from_secs(2);
/// After a refusal it tries again (assumed; other stacks give up).
const REFUSED: Duration = Duration::from_secs(10);

/// Where a client stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Connection {
    /// It has no address.
    Off,
    /// It is silent until then.
    Silent(SimTime),
    /// It waits for a task controller to show itself.
    Alone,
    /// It waits for an answer until then.
    Asking(Question, SimTime),
    /// Its pool is on its way.
    Uploading,
    /// The task controller uses its pool.
    Connected,
    /// The pool was refused; it tries again then.
    Refused(Refused, SimTime),
}

/// What an answer is awaited to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// The task controller's version.
    Version,
    /// Its language.
    Language,
    /// The structure of a pool that it has kept.
    Structure,
    /// The language of that pool.
    Localization,
    /// Whether it has forgotten that pool.
    Delete,
    /// Whether a pool may come.
    Transfer,
    /// Whether it came.
    Transferred,
    /// Whether it is in use.
    Activate,
}

/// What a task controller has against a pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refused {
    /// It did not even want to have it.
    pub at_transfer: bool,
    /// Its first byte of errors.
    pub code: u8,
    /// What is said to be wrong, and what that is part of.
    pub object: Option<u16>,
}

/// What a step has the client say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Say {
    /// It speaks for itself; then its status, and from now on every two seconds.
    Introduce,
    /// A question.
    Ask(Question),
    /// The pool.
    Upload,
}

/// What comes of time alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Passed {
    /// The task controller is lost.
    Lost,
    /// There is something to say.
    Say(Say),
}

/// The session.
#[derive(Clone, Debug)]
pub(super) struct Session {
    pub(super) state: Connection,
    /// The task controller's address, once it has shown itself.
    pub(super) server: Option<u8>,
    /// When its status was heard last.
    pub(super) heard: SimTime,
    pub(super) version: Version,
    pub(super) structure: [u8; 7],
    pub(super) localization: [u8; 7],
}

impl Session {
    pub(super) fn new(structure: [u8; 7], localization: [u8; 7]) -> Self {
        Self {
            state: Connection::Off,
            server: None,
            heard: SimTime::ZERO,
            version: Version::Fourth,
            structure,
            localization,
        }
    }

    /// It begins anew, with its silence.
    pub(super) fn reset(&mut self, at: SimTime) {
        (self.state, self.server) = (Connection::Silent(at + SILENCE), None);
    }

    /// The next instant at which time alone changes something.
    pub(super) fn next(&self) -> Option<SimTime> {
        let lost = self.server.map(|_| self.heard + SILENCE);
        let own = match self.state {
            Connection::Silent(until) | Connection::Asking(_, until) | Connection::Refused(_, until) => {
                Some(until)
            }
            _ => None,
        };
        own.into_iter().chain(lost).min()
    }

    /// Time passes.
    pub(super) fn poll(&mut self, at: SimTime) -> Option<Passed> {
        if self.server.is_some() && self.heard + SILENCE <= at {
            self.reset(at);
            return Some(Passed::Lost);
        }
        match self.state {
            Connection::Silent(until) if until <= at => self.state = Connection::Alone,
            // Not everyone answers; our pool speaks English then, too.
            Connection::Asking(Question::Language, until) if until <= at => {
                return Some(Passed::Say(self.ask(at, Question::Structure)));
            }
            Connection::Asking(_, until) | Connection::Refused(_, until) if until <= at => self.reset(at),
            _ => {}
        }
        None
    }

    /// The status of a task controller was heard.
    pub(super) fn shown(&mut self, at: SimTime, from: u8) -> Option<Say> {
        match (self.state, self.server) {
            (Connection::Alone, None) => {
                (self.server, self.heard) = (Some(from), at);
                Some(Say::Introduce)
            }
            (_, Some(server)) if server == from => {
                self.heard = at;
                None
            }
            _ => None,
        }
    }

    /// Waits for an answer.
    pub(super) fn ask(&mut self, at: SimTime, question: Question) -> Say {
        self.state = Connection::Asking(question, at + ANSWER);
        Say::Ask(question)
    }

    fn is_asking(&self, question: Question) -> bool {
        matches!(self.state, Connection::Asking(asked, _) if asked == question)
    }

    /// It told its version.
    pub(super) fn versioned(&mut self, at: SimTime, byte: u8) -> Option<Say> {
        self.is_asking(Question::Version).then(|| {
            self.version = Version::of(byte);
            self.ask(at, Question::Language)
        })
    }

    /// It told its language: our pool speaks ours.
    pub(super) fn spoken(&mut self, at: SimTime) -> Option<Say> {
        self.is_asking(Question::Language).then(|| self.ask(at, Question::Structure))
    }

    /// An answer about device descriptors.
    pub(super) fn answered(&mut self, at: SimTime, subcommand: u8, rest: [u8; 7]) -> Option<Say> {
        let asked = match subcommand {
            descriptor::STRUCTURE => Question::Structure,
            descriptor::LOCALIZATION => Question::Localization,
            descriptor::TRANSFER_ANSWER => Question::Transfer,
            descriptor::TRANSFERRED => Question::Transferred,
            descriptor::ACTIVATED => Question::Activate,
            descriptor::DELETED => Question::Delete,
            _ => return None,
        };
        if !self.is_asking(asked) {
            return None;
        }
        let [code, _, _, o0, o1, ..] = rest;
        match asked {
            Question::Structure | Question::Localization if rest == [0xFF; 7] => {
                Some(self.ask(at, Question::Transfer))
            }
            Question::Structure if rest == self.structure => Some(self.ask(at, Question::Localization)),
            Question::Localization if rest == self.localization => Some(self.ask(at, Question::Activate)),
            Question::Structure | Question::Localization => Some(self.ask(at, Question::Delete)),
            // Whatever is said of the old pool: the new one is sent.
            Question::Delete => Some(self.ask(at, Question::Transfer)),
            Question::Transfer if code == 0 => {
                self.state = Connection::Uploading;
                Some(Say::Upload)
            }
            Question::Transferred if code == 0 => Some(self.ask(at, Question::Activate)),
            Question::Activate if code == 0 => {
                self.state = Connection::Connected;
                None
            }
            _ => {
                let object = u16::from_le_bytes([o0, o1]);
                let refused = Refused {
                    at_transfer: asked != Question::Activate,
                    code,
                    object: (asked == Question::Activate && object != 0xFFFF).then_some(object),
                };
                self.state = Connection::Refused(refused, at + REFUSED);
                None
            }
        }
    }

    /// The pool has gone out, or not.
    pub(super) fn uploaded(&mut self, at: SimTime, arrived: bool) {
        if self.state == Connection::Uploading {
            match arrived {
                true => self.state = Connection::Asking(Question::Transferred, at + ANSWER),
                false => self.reset(at),
            }
        }
    }
}
