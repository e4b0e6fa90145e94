//! Boundaries and parts of telegrams in a byte stream.

use std::ops::Range;

use rowscan_protocol::frame::{self, Accept, Dialect};
use rowscan_protocol::lms2xx::frame as serial;

use crate::event::Direction;

/// What a stream's telegrams look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// CoLa A and CoLa B; told apart telegram by telegram.
    Cola,
    /// The LMS2xx's.
    Lms2xx,
}

/// The longest CoLa payload that is taken for one.
const MAX_PAYLOAD: usize = 256 * 1024;
/// Response code of the LMS2xx's measured values in most operating modes, and of those with reflectivities.
const SERIAL_SCANS: [u8; 2] = [0xB0, 0xF5];

/// Where a telegram is in its stream, and what it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Mark {
    pub(crate) offset: u64,
    pub(crate) len: usize,
    pub(crate) kind: Kind,
    /// A scan on its way to a client.
    pub(crate) is_scan: bool,
}

/// How a telegram is framed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    ColaA,
    ColaB,
    Lms2xx,
}

/// The parts of a telegram, as ranges of its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Regions {
    pub(crate) kind: Kind,
    /// Start marks and, where there is one, the address.
    pub(crate) header: Range<usize>,
    /// The length field.
    pub(crate) length: Option<Range<usize>>,
    pub(crate) payload: Range<usize>,
    pub(crate) checksum: Option<Range<usize>>,
}

impl Kind {
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::ColaA => "CoLa A",
            Self::ColaB => "CoLa B",
            Self::Lms2xx => "LMS2xx",
        }
    }

    pub(crate) fn regions(self, len: usize) -> Regions {
        let part = |from: usize, to: usize| from.min(len)..to.min(len);
        let (header, length, payload, checksum) = match self {
            Self::ColaA => (part(0, 1), None, part(1, len.saturating_sub(1)), None),
            Self::ColaB => {
                let end = len.saturating_sub(1);
                (part(0, 4), Some(part(4, 8)), part(8, end), Some(part(end, len)))
            }
            Self::Lms2xx => {
                let end = len.saturating_sub(2);
                (part(0, 2), Some(part(2, 4)), part(4, end), Some(part(end, len)))
            }
        };
        Regions { kind: self, header, length, payload, checksum }
    }

    /// Whether a client's payload is this command: in CoLa its kind and name, or its name alone; of an LMS2xx its first bytes in hex digits.
    pub(crate) fn is_command(self, payload: &[u8], command: &str) -> bool {
        let begins = |payload: &[u8], with: &[u8]| {
            payload.strip_prefix(with).is_some_and(|rest| rest.first().is_none_or(|next| *next == b' '))
        };
        match self {
            Self::ColaA | Self::ColaB => {
                begins(payload, command.as_bytes())
                    || payload.get(4..).is_some_and(|name| begins(name, command.as_bytes()))
            }
            Self::Lms2xx => {
                let digits: Vec<char> = command.chars().filter(|digit| !digit.is_whitespace()).collect();
                let mut asked = digits.chunks(2).map(|pair| {
                    let pair: String = pair.iter().collect();
                    u8::from_str_radix(&pair, 16).ok()
                });
                let is_same = |byte: &u8| asked.next().is_none_or(|asked| asked == Some(*byte));
                payload.len() * 2 >= digits.len() && !digits.is_empty() && payload.iter().all(is_same)
            }
        }
    }

    /// A well-formed telegram of this kind that nobody asked for, from the other side.
    pub(crate) fn foreign(self, direction: Direction) -> Vec<u8> {
        let mut bytes = Vec::new();
        let payload: &[u8] = match direction {
            Direction::ToClient => b"sAN ForeignTelegram 1",
            Direction::ToDevice => b"sRN ForeignTelegram",
        };
        match self {
            Self::ColaA => frame::encode(Dialect::A, payload, &mut bytes),
            Self::ColaB => frame::encode(Dialect::B, payload, &mut bytes),
            Self::Lms2xx => match direction {
                // A status reply (B1) with a body too short for one.
                Direction::ToClient => serial::encode(serial::FROM_DEVICE, &[0xB1, 0x00], &mut bytes),
                Direction::ToDevice => serial::encode(0, &[0x31], &mut bytes),
            },
        }
        bytes
    }
}

/// Follows a stream and tells where its telegrams are.
#[derive(Debug)]
pub(crate) enum Tracker {
    Cola(frame::FrameDecoder, Direction),
    Lms2xx(serial::FrameDecoder, Direction),
}

impl Tracker {
    pub(crate) fn new(language: Language, direction: Direction) -> Self {
        match language {
            Language::Cola => Self::Cola(frame::FrameDecoder::new(Accept::Either, MAX_PAYLOAD), direction),
            Language::Lms2xx => {
                let listener = match direction {
                    Direction::ToClient => serial::Listener::Host,
                    Direction::ToDevice => serial::Listener::Device,
                };
                Self::Lms2xx(serial::FrameDecoder::new(listener), direction)
            }
        }
    }

    /// Takes the next bytes; then [`next`](Self::next) until it gives none.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        match self {
            Self::Cola(decoder, _) => decoder.push(bytes),
            Self::Lms2xx(decoder, _) => decoder.push(bytes),
        }
    }

    /// What is unfinished stays so: no more bytes come for now.
    pub(crate) fn finish(&mut self) {
        match self {
            Self::Cola(decoder, _) => decoder.finish(),
            Self::Lms2xx(decoder, _) => decoder.finish(),
        }
    }

    /// Bytes that may be the beginning of a telegram.
    pub(crate) fn pending(&self) -> usize {
        match self {
            Self::Cola(decoder, _) => decoder.pending(),
            Self::Lms2xx(decoder, _) => decoder.pending(),
        }
    }

    /// The next good telegram.
    pub(crate) fn next(&mut self) -> Option<Mark> {
        match self {
            Self::Cola(decoder, direction) => {
                let found = decoder.next_frame()?;
                let kind = if found.dialect == Dialect::A { Kind::ColaA } else { Kind::ColaB };
                let is_scan = *direction == Direction::ToClient && is_cola_scan(found.payload);
                Some(Mark { offset: found.offset, len: found.len, kind, is_scan })
            }
            Self::Lms2xx(decoder, direction) => loop {
                match decoder.next_received()? {
                    serial::Received::Frame(found) => {
                        let is_scan = *direction == Direction::ToClient
                            && found.body.first().is_some_and(|code| SERIAL_SCANS.contains(code));
                        let (offset, len) = (found.offset, found.len);
                        return Some(Mark { offset, len, kind: Kind::Lms2xx, is_scan });
                    }
                    serial::Received::Broken
                    | serial::Received::CutOff { .. }
                    | serial::Received::Ack
                    | serial::Received::Nak => {}
                }
            },
        }
    }
}

/// A scan that was subscribed to, or polled for.
fn is_cola_scan(payload: &[u8]) -> bool {
    let name = payload.get(4..).and_then(|rest| rest.strip_prefix(b"LMDscandata"));
    let ends = name.is_some_and(|rest| rest.first().is_none_or(|next| *next == b' '));
    ends && (payload.starts_with(b"sSN ") || payload.starts_with(b"sRA "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_cover_the_telegram() {
        for kind in [Kind::ColaA, Kind::ColaB, Kind::Lms2xx] {
            let bytes = kind.foreign(Direction::ToClient);
            let regions = kind.regions(bytes.len());
            let covered = [Some(regions.header), regions.length, Some(regions.payload), regions.checksum];
            let covered: usize = covered.into_iter().flatten().map(|part| part.len()).sum();
            // In CoLa A the closing mark belongs to no part.
            assert_eq!(covered, bytes.len() - usize::from(kind == Kind::ColaA), "{kind:?}");
        }
    }

    #[test]
    fn scans_are_told_from_replies_and_other_names() {
        assert!(is_cola_scan(b"sSN LMDscandata 1 1") && is_cola_scan(b"sRA LMDscandata 1"));
        for other in [&b"sEA LMDscandata 1"[..], b"sSN LMDscandatacfg 1", b"sSN LIDinputstate 1", b"sRA"] {
            assert!(!is_cola_scan(other), "{}", String::from_utf8_lossy(other));
        }
        let mut tracker = Tracker::new(Language::Lms2xx, Direction::ToClient);
        let mut bytes = vec![serial::ACK];
        serial::encode(serial::FROM_DEVICE, &[0xB0, 1, 0, 1, 0, 0x10], &mut bytes);
        serial::encode(serial::FROM_DEVICE, &[0xB1, 0x10], &mut bytes);
        tracker.push(&bytes);
        let marks: Vec<_> =
            std::iter::from_fn(|| tracker.next()).map(|mark| (mark.offset, mark.is_scan)).collect();
        assert_eq!(marks, [(1, true), (13, false)]);
    }
}
