//! CAN frames that a rig's buses have heard from others, and what of them is waited for.

use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};

use rowscan_bus::{CanFrame, CanId, J1939Id};
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, Tap, Taps};

use crate::journal::Journal;

/// A frame that is waited for: `0x18FF1080`, or `pgn:0xCB00 cmd:0xE`, of any address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FramePattern {
    /// A frame of this identifier, 11 or 29 bits.
    Id(u32),
    /// A J1939 group, and the low four bits of its first byte, where a task controller's messages have their command.
    Group {
        /// The parameter group's number.
        pgn: u32,
        /// Its command.
        command: Option<u8>,
    },
}

impl FromStr for FramePattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected a frame such as 0x18FF1080 or pgn:0xCB00 cmd:0xE, found `{text}`");
        let number = |digits: &str| {
            let hex = digits.strip_prefix("0x").ok_or_else(wrong)?;
            u32::from_str_radix(hex, 16).map_err(|_| wrong())
        };
        let Some(group) = text.strip_prefix("pgn:") else { return number(text).map(Self::Id) };
        let (pgn, command) = match group.split_once(" cmd:") {
            Some((pgn, command)) => {
                let command = number(command)?;
                (pgn, Some(u8::try_from(command).ok().filter(|command| *command < 16).ok_or_else(wrong)?))
            }
            None => (group, None),
        };
        Ok(Self::Group { pgn: number(pgn)?, command })
    }
}

impl FramePattern {
    fn fits(self, (id, first): (u32, Option<u8>)) -> bool {
        match self {
            Self::Id(wanted) => id == wanted,
            Self::Group { pgn, command } => {
                J1939Id::of(CanId::Extended(id)).is_some_and(|id| id.pgn == pgn)
                    && command.is_none_or(|command| first.is_some_and(|first| first & 0xF == command))
            }
        }
    }
}

/// A frame that a bus has carried.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carried {
    pub(crate) at: SimTime,
    /// Sent by somebody else than the bench.
    pub(crate) from_others: bool,
    pub(crate) frame: CanFrame,
}

impl Carried {
    /// A line of a candump log, with simulated time.
    pub(crate) fn candump_line(&self, bus: &str) -> String {
        let (s, us) = (self.at.0 / 1_000_000_000, self.at.0 / 1000 % 1_000_000);
        format!("({s}.{us:06}) {bus} {}\n", self.frame.to_text())
    }
}

/// Frames of a bus that are kept.
const KEPT: usize = 2_000_000;

/// What the buses of a run have carried. Clones share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Frames(Arc<Mutex<Heard>>);

#[derive(Debug, Default)]
struct Heard {
    /// Identifiers and first bytes, if a frame has one, that others than the bench have sent.
    kinds: BTreeSet<(u32, Option<u8>)>,
    buses: BTreeMap<String, BusRecord>,
}

/// What one bus has carried.
#[derive(Clone, Debug, Default)]
pub(crate) struct BusRecord {
    pub(crate) all: Vec<Carried>,
    /// Frames that there was no room for.
    pub(crate) lost: u64,
}

impl Frames {
    /// Taps that listen to the bus `id`.
    pub(crate) fn taps(&self, id: &str, journal: &Journal) -> Taps {
        self.lock().buses.entry(id.to_owned()).or_default();
        let (frames, id, journal) = (self.clone(), id.to_owned(), journal.clone());
        Taps::new(move |_, _| {
            let (frames, id, journal) = (frames.clone(), id.clone(), journal.clone());
            Tap::new(move |from, bytes| frames.carry(&id, journal.now(), (from, bytes)))
        })
    }

    fn carry(&self, bus: &str, at: SimTime, (from, text): (Side, &[u8])) {
        let Some(frame) = std::str::from_utf8(text).ok().and_then(CanFrame::from_text) else { return };
        let from_others = from == Side::Host;
        let mut heard = self.lock();
        if from_others {
            heard.kinds.insert((frame.id.bits(), frame.data().first().copied()));
        }
        let Some(record) = heard.buses.get_mut(bus) else { return };
        if record.all.len() < KEPT {
            record.all.push(Carried { at, from_others, frame });
        } else {
            record.lost += 1;
        }
    }

    /// True once a frame of somebody else fits.
    pub(crate) fn heard(&self, pattern: FramePattern) -> bool {
        self.lock().kinds.iter().any(|frame| pattern.fits(*frame))
    }

    /// What the bus `id` has carried so far.
    pub(crate) fn so_far(&self, id: &str) -> Option<BusRecord> {
        self.lock().buses.get(id).cloned()
    }

    /// What each bus has carried.
    pub(crate) fn close(&self) -> BTreeMap<String, BusRecord> {
        std::mem::take(&mut self.lock().buses)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Heard> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_known_by_its_identifier_or_its_group() {
        let frames = Frames::default();
        let tap = frames
            .taps("can0", &crate::witness::tests::bench(1).0.journal())
            .open("can", rowscan_recording::StreamKind::Can);
        tap.record(Side::Device, b"18FF1080#00");
        let heard = |text: &str| text.parse().map(|pattern| frames.heard(pattern));
        assert_eq!(heard("0x18FF1080"), Ok(false), "our own does not count");
        tap.record(Side::Host, b"18FF1080#00");
        tap.record(Side::Host, b"14CBF726#FEFF");
        assert_eq!(heard("0x18FF1080"), Ok(true));
        assert_eq!((heard("pgn:0xCB00"), heard("pgn:0xCB00 cmd:0xE")), (Ok(true), Ok(true)));
        assert_eq!((heard("pgn:0xCB00 cmd:0xF"), heard("pgn:0xCA00")), (Ok(false), Ok(false)));
        for nonsense in ["", "18FF1080", "0xZ", "pgn:CB00", "pgn:0xCB00 cmd:0x10"] {
            assert!(nonsense.parse::<FramePattern>().is_err(), "{nonsense}");
        }
    }
}
