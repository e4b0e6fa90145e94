//! CAN frames that a rig's buses have heard from others, and what of them is waited for.

use std::collections::BTreeSet;
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};

use rowscan_bus::{CanFrame, CanId, J1939Id};
use rowscan_recording::{Side, Tap, Taps};

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

/// What all buses of a run have heard: identifiers with first bytes. Clones share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Frames(Arc<Mutex<BTreeSet<(u32, Option<u8>)>>>);

impl Frames {
    /// Taps that listen to a bus.
    pub(crate) fn taps(&self) -> Taps {
        let frames = self.clone();
        Taps::new(move |_, _| {
            let frames = frames.clone();
            Tap::new(move |from, bytes| {
                if from == Side::Host {
                    frames.hear(bytes);
                }
            })
        })
    }

    fn hear(&self, text: &[u8]) {
        let Some(frame) = std::str::from_utf8(text).ok().and_then(CanFrame::from_text) else { return };
        let (CanId::Standard(id), first) = (frame.id, frame.data().first().copied()) else {
            let CanId::Extended(id) = frame.id else { return };
            self.lock().insert((id, frame.data().first().copied()));
            return;
        };
        self.lock().insert((u32::from(id), first));
    }

    /// True once a frame fits.
    pub(crate) fn heard(&self, pattern: FramePattern) -> bool {
        self.lock().iter().any(|frame| pattern.fits(*frame))
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, BTreeSet<(u32, Option<u8>)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_known_by_its_identifier_or_its_group() {
        let frames = Frames::default();
        let tap = frames.taps().open("can", rowscan_recording::StreamKind::Can);
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
