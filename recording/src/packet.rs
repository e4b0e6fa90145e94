//! One stretch of recorded bytes.

use std::fmt;
use std::str::FromStr;

use rowscan_protocol::telegram::Kind;
#[cfg(feature = "files")]
use serde::Serialize;

/// Who sent bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "files", derive(Serialize), serde(rename_all = "lowercase"))]
pub enum Side {
    /// The client.
    Host,
    /// The scanner, or whatever else stands on the tractor.
    Device,
}

impl Side {
    /// Who sends telegrams of this kind: only hosts ask, only devices answer.
    pub fn of(kind: Kind) -> Self {
        match kind {
            Kind::Rn | Kind::Ri | Kind::Wn | Kind::Mn | Kind::En => Self::Host,
            Kind::Ra | Kind::Wa | Kind::Ma | Kind::An | Kind::Ea | Kind::Sn | Kind::Fa => Self::Device,
        }
    }
}

/// What the bytes of a stream are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "files", derive(Serialize), serde(rename_all = "lowercase"))]
pub enum StreamKind {
    /// CoLa telegrams over TCP or a serial line.
    #[default]
    Cola,
    /// LMS2xx telegrams on a serial line.
    Lms2xx,
    /// Compact telegrams of a picoScan, multiScan or LRS4000: datagrams, or one behind the other.
    Compact,
    /// NMEA 0183 sentences.
    Nmea,
    /// CAN frames, one a packet, as a candump line has them: `ID#DATA`.
    Can,
    /// Anything else, kept and given back as it was.
    Bytes,
}

/// Every kind with the name it has in a file.
const KINDS: [(StreamKind, &str); 6] = [
    (StreamKind::Cola, "cola"),
    (StreamKind::Lms2xx, "lms2xx"),
    (StreamKind::Compact, "compact"),
    (StreamKind::Nmea, "nmea"),
    (StreamKind::Can, "can"),
    (StreamKind::Bytes, "bytes"),
];

impl StreamKind {
    /// True if its bytes are telegrams of a scanner, which frames are looked for in.
    pub fn is_scanner(self) -> bool {
        matches!(self, Self::Cola | Self::Lms2xx | Self::Compact)
    }
}

impl fmt::Display for StreamKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = KINDS.iter().find(|(kind, _)| kind == self).map_or("bytes", |(_, name)| name);
        f.write_str(name)
    }
}

impl FromStr for StreamKind {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        KINDS.iter().find(|(_, name)| *name == text).map(|(kind, _)| *kind).ok_or(())
    }
}

/// How recorded bytes join those before them in the same direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Joint {
    /// They follow on.
    #[default]
    Seamless,
    /// They are a beginning of their own: a telegram that was unfinished before stays so.
    Anew,
    /// The recording begins here, perhaps inside a telegram.
    Inside,
    /// Something between was not recorded.
    Gap {
        /// So many bytes, where that is known.
        bytes: u64,
        /// So many packets, where that is known.
        packets: u64,
    },
}

/// Bytes that went one way over one connection at one time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Packet {
    /// Which stream of the recording, counted from 0 in the order they appear.
    pub stream: usize,
    /// Who sent them; none where a log does not say.
    pub from: Option<Side>,
    /// When the host saw them, ns since 1970 or since the recording began; none where a log does not say.
    pub at_ns: Option<u64>,
    /// How they join what this direction sent before.
    pub joint: Joint,
    /// What was sent.
    pub bytes: Vec<u8>,
}
