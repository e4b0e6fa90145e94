//! The host's side of every scanner protocol: one trait, one event type, one scan.
//!
//! [`ColaClient`](crate::client::ColaClient) and [`Lms2xxClient`](crate::lms2xx::client::Lms2xxClient) implement [`HostSession`]; a
//! driver or a reader of recordings needs to know no more of them than how they are made.
//!
//! Calling order: hand in bytes ([`HostSession::handle_bytes`]) or time ([`HostSession::handle_timeout`]); then take events
//! ([`HostSession::poll_event`]) until there is none, then output ([`HostSession::poll_transmit`]) until there is none, then ask when time
//! is due next ([`HostSession::poll_timeout`]). A new session begins with `poll_transmit`.
//!
//! Time is a [`Duration`] since an epoch of the caller's choice.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;
use core::time::Duration;

use crate::compact::SegmentCounts;
use crate::frame::{Dialect, FrameCounts};
use crate::heard_settings::HeardSettings;
use crate::leftover::Leftover;
use crate::lms2xx::Rate;
use crate::reading::Reading;
use crate::scan::Scan;
use crate::telegram::SopasError;
use crate::validity::ScanFault;

/// One connection to a scanner, or a tapped line, without I/O.
pub trait HostSession: fmt::Debug {
    /// Takes received bytes.
    fn handle_bytes(&mut self, now: Duration, bytes: &[u8]);

    /// No more bytes will come, as at a recording's end: valid frames inside an unfinished one are found.
    fn handle_end(&mut self);

    /// What is unfinished stays so: bytes are missing between those that came and those that will.
    fn handle_gap(&mut self) {
        self.handle_end();
    }

    /// Takes bytes of the other direction: of a tapped line, a session that listens hears what the host says. With `follows_gap` they do not follow those
    /// before them.
    fn overhear(&mut self, bytes: &[u8], follows_gap: bool) {
        let _ = (bytes, follows_gap);
    }

    /// Tells the session the time.
    fn handle_timeout(&mut self, now: Duration);

    /// When [`handle_timeout`](Self::handle_timeout) is due; `None` while no reply is awaited.
    fn poll_timeout(&self) -> Option<Duration>;

    /// The next output, in the order it must be sent.
    fn poll_transmit(&mut self) -> Option<Transmit>;

    /// The next event. One call reads no further than the next scan.
    fn poll_event(&mut self) -> Option<HostEvent>;

    /// Begins a clean stop: the stream ends, then [`HostEvent::Stopped`].
    fn stop(&mut self, now: Duration);

    /// The scan of the last [`HostEvent::Scan`], valid until the next call that takes `&mut self`.
    fn scan(&self) -> &Scan;

    /// Frames and bytes received so far.
    fn counts(&self) -> FrameCounts;

    /// Parts of scans that were lost on their way, where the scanner sends scans in parts: those scans have beams of which nothing is known.
    fn segments_lost(&self) -> u64 {
        self.segments().lost
    }

    /// What became of the parts of scans, where the scanner sends scans in parts.
    fn segments(&self) -> SegmentCounts {
        SegmentCounts::default()
    }

    /// Other scanners whose telegrams come in the same stream, and are left out.
    fn other_senders(&self) -> &[OtherSender] {
        &[]
    }

    /// Of a session that only listens, which settings it has heard of: scans are told by them ([`Scan::echo`], [`Scan::leftovers`]).
    fn heard_settings(&mut self) -> Option<&mut HeardSettings> {
        None
    }

    /// The number of the turn that had begun when its segments ended, and gave no scan.
    fn unfinished_turn(&self) -> Option<u64> {
        None
    }

    /// True once the session waits for nothing more and sends nothing more.
    fn is_done(&self) -> bool;
}

/// Output of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Transmit {
    /// One frame, to be sent in one write.
    Frame(Vec<u8>),
    /// Nothing to send: the serial line runs at this rate from here on, once everything before has left.
    Rate(Rate),
}

impl Transmit {
    /// The frame's bytes; `None` for a change of the rate.
    pub fn into_frame(self) -> Option<Vec<u8>> {
        match self {
            Self::Frame(frame) => Some(frame),
            Self::Rate(_) => None,
        }
    }
}

/// What a session tells its caller.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum HostEvent {
    /// The device is set up and will send scans.
    Ready(DeviceInfo),
    /// A scan arrived: [`HostSession::scan`].
    Scan,
    /// The device refused a command.
    Refused {
        /// The command: its CoLa name, or the LMS2xx request in words.
        command: &'static str,
        /// The device's reason; an LMS2xx gives none.
        error: Option<Refusal>,
        /// The start-up cannot go on without it: the session is done.
        fatal: bool,
    },
    /// The device cannot do something that would be of use; scans come nevertheless.
    Limited {
        /// What it cannot do, and what follows.
        what: &'static str,
    },
    /// Another client had left a setting that takes beams, echoes, layers or turns away; it was put right, unless the device refused.
    Leftover {
        /// The setting.
        setting: &'static Leftover,
        /// Why the device keeps it.
        refused: Option<Refusal>,
    },
    /// No answer in time: the wrong dialect or rate, or no device. The session is done. Try the other CoLa dialect over a new connection:
    /// some devices stay silent for the rest of one that began in the wrong dialect.
    NoAnswer {
        /// The command: its CoLa name, or the LMS2xx request in words.
        command: &'static str,
    },
    /// The scanner told how it moves, or what its encoder counts.
    Reading(Reading),
    /// Telegrams of another scanner come in the same stream for the first time: they are left out, and counted by
    /// [`HostSession::other_senders`].
    OtherSender {
        /// Its serial number, if it says one.
        found: Option<u32>,
        /// That of the scanner that is listened to.
        followed: Option<u32>,
    },
    /// A scan telegram in a valid frame cannot be read.
    Malformed {
        /// Why.
        fault: ScanFault,
    },
    /// The device has restarted and must be set up again. The session is done.
    Restarted,
    /// The clean stop is done.
    Stopped,
}

/// What became of a device's settings, where that is not all that was wanted. Serves messages and documents alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SettingNote {
    /// As [`HostEvent::Leftover`].
    Leftover {
        /// The setting.
        setting: &'static Leftover,
        /// Why the device keeps it.
        refused: Option<Refusal>,
    },
    /// As [`HostEvent::Refused`], where scans come nevertheless.
    Refused {
        /// The command: its CoLa name, or the LMS2xx request in words.
        command: &'static str,
        /// The device's reason; an LMS2xx gives none.
        error: Option<Refusal>,
    },
    /// As [`HostEvent::Limited`].
    Limited {
        /// What it cannot do, and what follows.
        what: &'static str,
    },
}

impl SettingNote {
    /// What an event says of settings; none of another event, and of a refusal that ends the session.
    pub fn of(event: &HostEvent) -> Option<Self> {
        Some(match *event {
            HostEvent::Leftover { setting, refused } => Self::Leftover { setting, refused },
            HostEvent::Refused { command, error, fatal: false } => Self::Refused { command, error },
            HostEvent::Limited { what } => Self::Limited { what },
            _ => return None,
        })
    }

    /// Whether the device keeps the echo that it sends, whichever that is.
    pub fn refuses_echo(&self) -> bool {
        matches!(self, Self::Refused { command: "FREchoFilter", .. })
    }

    /// One word to branch on.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Leftover { refused: None, .. } => "setting_restored",
            Self::Leftover { refused: Some(_), .. } => "setting_kept",
            Self::Refused { .. } => "setting_refused",
            Self::Limited { .. } => "scanner_limited",
        }
    }
}

impl fmt::Display for SettingNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Leftover { setting, refused: None } => {
                write!(
                    f,
                    "{}: another client had left it so; that is undone for this run, and stored settings stay",
                    setting.found
                )
            }
            Self::Leftover { setting, refused: Some(error) } => write!(
                f,
                "{}: another client had left it so, and the scanner refused to have it undone ({error}), so what is measured is wrong by it; undo it with \
                 the maker's software",
                setting.found
            ),
            Self::Refused { command, error: None } => {
                write!(f, "it refused: {command}; it keeps its own setting")
            }
            Self::Refused { command, error: Some(error) } => {
                write!(f, "it refused `{command}` ({error}) and keeps its own setting")
            }
            Self::Limited { what } => f.write_str(what),
        }
    }
}

/// Why a device refused a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// By CoLa.
    Cola(SopasError),
    /// By REST.
    Rest {
        /// `header.status` of the answer; none where the answer has none.
        status: Option<u64>,
        /// The code of HTTP.
        http: u16,
    },
    /// By REST: the method was called, and failed.
    Method {
        /// Its `ErrorCode`.
        code: u64,
    },
    /// By no REST of a scanner: what answers speaks HTTP, and no JSON.
    NotJson {
        /// A page of HTML.
        is_html: bool,
        /// The code of HTTP.
        http: u16,
    },
    /// By REST: so many requests, or failed logins, that it takes no more for a while.
    TooMany {
        /// The code of HTTP.
        http: u16,
    },
    /// By REST: challenges that it gave itself, though it took the same password before.
    StaleNonce {
        /// The code of HTTP.
        http: u16,
    },
}

impl From<SopasError> for Refusal {
    fn from(error: SopasError) -> Self {
        Self::Cola(error)
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cola(error) => error.fmt(f),
            Self::Rest { status: Some(status), http } => write!(f, "status {status}, HTTP {http}"),
            Self::Rest { status: None, http } => write!(f, "HTTP {http}"),
            Self::Method { code } => write!(f, "error code {code}"),
            Self::NotJson { is_html, http } => {
                write!(f, "found {}, HTTP {http}", if *is_html { "HTML" } else { "no JSON" })
            }
            Self::TooMany { http } => write!(f, "too many requests, HTTP {http}"),
            Self::StaleNonce { http } => write!(f, "invalid challenge, HTTP {http}"),
        }
    }
}

/// A scanner whose telegrams come in the same stream as those of the one that is listened to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct OtherSender {
    /// Its serial number; none where it is one of more than can be told apart.
    pub serial_number: Option<u32>,
    /// Telegrams of it that were left out.
    pub telegrams: u64,
}

impl OtherSender {
    /// Telegrams of all these.
    pub fn telegrams_of(all: &[Self]) -> u64 {
        all.iter().map(|other| other.telegrams).sum()
    }
}

/// What a device says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceInfo {
    /// Name and version (CoLa), name and variant (LMS2xx).
    pub ident: String,
    /// Firmware version, without the blanks devices pad it with.
    pub firmware: String,
    /// What it was addressed in.
    pub language: Language,
}

/// A protocol as spoken on one connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Language {
    /// CoLa in this dialect.
    Cola(Dialect),
    /// LMS2xx telegrams at this rate.
    Lms2xx(Rate),
    /// Compact telegrams over UDP, and REST.
    Compact,
}

impl fmt::Display for Language {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cola(dialect) => dialect.fmt(f),
            Self::Lms2xx(rate) => write!(f, "{rate} bits a second"),
            Self::Compact => f.write_str("Compact over UDP"),
        }
    }
}
