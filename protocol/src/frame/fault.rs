//! Why bytes are no frame: for people who look at a recording. The decoder itself only counts.

use alloc::format;
use alloc::string::String;
use core::ops::Range;

use byteorder::{BigEndian, ByteOrder};

use super::{COMMAND_LETTER, ETX, STX, cola_b};

/// What is wrong with a stretch of bytes that belongs to no frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameFault {
    /// The stretch, as indices of the stream.
    pub bytes: Range<usize>,
    /// Index in the stream of the first byte that is wrong.
    pub at: usize,
    /// What is wrong there.
    pub kind: FaultKind,
}

/// Ways to be no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultKind {
    /// Not even a start; the byte that stood there.
    NoStart(u8),
    /// A start that no command follows; the byte that stood there.
    NoCommand(u8),
    /// A CoLa B length of zero, or one larger than any telegram.
    Length {
        /// What the header claims.
        claimed: u32,
        /// The largest that is taken.
        most: usize,
    },
    /// A CoLa B checksum that does not fit its payload.
    Checksum {
        /// XOR of the payload's bytes.
        computed: u8,
        /// What the frame holds.
        found: u8,
    },
    /// CoLa A text that meets the next start before its end.
    NoEnd(u8),
    /// The stream ends before the frame does; bytes that are missing at least.
    Cut(usize),
}

impl FaultKind {
    /// What a frame would have there.
    pub fn expected(&self) -> String {
        match self {
            Self::NoStart(_) => format!("{STX:02X}, the start of a frame"),
            Self::NoCommand(_) => format!("{COMMAND_LETTER:02X}, the first letter of a command"),
            Self::Length { most, .. } => format!("a payload length of 1 to {most}"),
            Self::Checksum { computed, .. } => format!("checksum {computed:02X}"),
            Self::NoEnd(_) => format!("{ETX:02X}, the end of the text"),
            Self::Cut(missing) => format!("{missing} more bytes at least"),
        }
    }

    /// What stood there.
    pub fn found(&self) -> String {
        match self {
            Self::NoStart(byte) | Self::NoCommand(byte) | Self::NoEnd(byte) => format!("{byte:02X}"),
            Self::Length { claimed, .. } => format!("{claimed}"),
            Self::Checksum { found, .. } => format!("{found:02X}"),
            Self::Cut(_) => String::from("the end"),
        }
    }
}

/// The first fault in `skipped`, a range of `stream` in which a decoder found no frame; none if it is empty. The next one is
/// found in what of `skipped` follows this one's `bytes`.
pub fn fault(stream: &[u8], skipped: Range<usize>, max_payload: usize) -> Option<FrameFault> {
    let start = skipped.start;
    let rest = stream.get(start..)?;
    let first = *rest.get(..skipped.len())?.first()?;
    // Bytes the fault takes up, at most; where in them it is; what it is.
    let (extent, at, kind) = match rest.get(1).copied() {
        _ if first != STX => {
            let junk = rest.iter().position(|&b| b == STX).unwrap_or(rest.len());
            (junk, 0, FaultKind::NoStart(first))
        }
        None => (1, 1, FaultKind::Cut(1)),
        Some(STX) => binary(rest, max_payload),
        Some(COMMAND_LETTER) => {
            match rest.iter().enumerate().skip(1).find(|(_, b)| matches!(**b, STX | ETX)) {
                Some((at, &byte)) => (at, at, FaultKind::NoEnd(byte)),
                None => (rest.len(), rest.len(), FaultKind::Cut(1)),
            }
        }
        Some(other) => (next_start(rest, 1), 1, FaultKind::NoCommand(other)),
    };
    let end = start + extent.clamp(1, skipped.len());
    Some(FrameFault { bytes: start..end, at: start + at, kind })
}

/// What is wrong with two STX and what follows.
fn binary(rest: &[u8], max_payload: usize) -> (usize, usize, FaultKind) {
    let starts = rest.iter().take(cola_b::START.len()).take_while(|&&b| b == STX).count();
    if starts < cola_b::START.len() {
        return match rest.get(starts) {
            Some(&other) => (starts, starts, FaultKind::NoStart(other)),
            None => (starts, starts, FaultKind::Cut(cola_b::OVERHEAD - starts)),
        };
    }
    let header = cola_b::OVERHEAD - 1;
    let Some(length) = rest.get(starts..header) else {
        return (rest.len(), rest.len(), FaultKind::Cut(cola_b::OVERHEAD - rest.len()));
    };
    let claimed = BigEndian::read_u32(length);
    let payload = claimed as usize;
    if payload == 0 || payload > max_payload {
        return (next_start(rest, header), starts, FaultKind::Length { claimed, most: max_payload });
    }
    match (rest.get(header), rest.get(header + payload)) {
        (Some(&other), _) if other != COMMAND_LETTER => {
            (next_start(rest, header), header, FaultKind::NoCommand(other))
        }
        (_, None) => (rest.len(), rest.len(), FaultKind::Cut(header + payload + 1 - rest.len())),
        (_, Some(&found)) => {
            let computed = cola_b::checksum(rest.get(header..header + payload).unwrap_or_default());
            (header + payload + 1, header + payload, FaultKind::Checksum { computed, found })
        }
    }
}

/// Index of the next STX from `from` on, or the length.
fn next_start(rest: &[u8], from: usize) -> usize {
    let tail = rest.get(from..).unwrap_or_default();
    tail.iter().position(|&b| b == STX).map_or(rest.len(), |at| from + at)
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;
    use crate::frame::{Dialect, encode};

    fn only(stream: &[u8]) -> (Range<usize>, usize, FaultKind) {
        let FrameFault { bytes, at, kind } = fault(stream, 0..stream.len(), 1000).unwrap();
        (bytes, at, kind)
    }

    #[test]
    fn every_way_to_be_no_frame_is_located() {
        let mut framed = Vec::new();
        encode(Dialect::B, b"sMN Run", &mut framed);
        let with = |at: usize, byte: u8| {
            let mut changed = framed.clone();
            changed[at] = byte;
            changed
        };
        assert_eq!(only(b"junk\x02sR"), (0..4, 0, FaultKind::NoStart(b'j')));
        assert_eq!(only(b"\x02xx\x03"), (0..4, 1, FaultKind::NoCommand(b'x')));
        assert_eq!(only(b"\x02sRN a\x02sRN b\x03"), (0..6, 6, FaultKind::NoEnd(STX)));
        assert_eq!(only(b"\x02sRN a"), (0..6, 6, FaultKind::Cut(1)));
        assert_eq!(only(&with(15, 0x1A)), (0..16, 15, FaultKind::Checksum { computed: 0x19, found: 0x1A }));
        assert_eq!(only(&with(4, 0x7F)), (0..16, 4, FaultKind::Length { claimed: 0x7F00_0007, most: 1000 }));
        assert_eq!(only(&with(8, b'x')), (0..16, 8, FaultKind::NoCommand(b'x')));
        assert_eq!(only(&with(2, 0)), (0..2, 2, FaultKind::NoStart(0)));
        for len in 1..framed.len() {
            assert!(matches!(only(&framed[..len]).2, FaultKind::Cut(_)), "{len}");
        }
        assert_eq!(only(&framed[..12]).2, FaultKind::Cut(4));
        assert_eq!(fault(&framed, 0..0, 1000), None);
    }
}
