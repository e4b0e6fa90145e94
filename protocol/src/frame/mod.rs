//! Frames: which bytes of a stream are a telegram.
//!
//! | | CoLa A | CoLa B |
//! |---|---|---|
//! | start | `02` | `02 02 02 02`, then the payload's length, u32 big-endian |
//! | payload | ASCII text | `sXX` + blank + name + blank + binary arguments |
//! | end | `03` | one byte: XOR of all payload bytes ([`checksum`]) |
//!
//! The two dialects differ in how a frame is recognised and [written](encode_with); the search for the
//! next good frame after junk is the same loop for both, in [`FrameDecoder`].

mod cola_a;
mod cola_b;
mod decoder;
mod fault;

use alloc::vec::Vec;
use core::fmt;

pub use cola_b::checksum;
pub use decoder::{Accept, Frame, FrameCounts, FrameDecoder};
pub use fault::{FaultKind, FrameFault, fault};

/// Start of text: one opens a CoLa A frame, four open a CoLa B frame.
pub const STX: u8 = 0x02;
/// End of text: closes a CoLa A frame.
pub const ETX: u8 = 0x03;
/// Every CoLa payload, in both dialects, begins with this letter.
const COMMAND_LETTER: u8 = b's';

/// The two encodings of SICK's command language.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Dialect {
    /// Text between STX and ETX, no checksum.
    A,
    /// Binary with length and checksum.
    B,
}

impl Dialect {
    /// The other dialect, which a client tries next when it gets no answer.
    pub fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::A => "CoLa A",
            Self::B => "CoLa B",
        })
    }
}

/// Appends `payload` as one frame.
///
/// A CoLa A payload must not hold STX or ETX; text made by the telegram writer never does.
pub fn encode(dialect: Dialect, payload: &[u8], out: &mut Vec<u8>) {
    out.reserve(payload.len() + cola_b::OVERHEAD);
    encode_with(dialect, out, |out| out.extend_from_slice(payload));
}

/// Appends one frame around the payload that `write` appends, which is not copied again.
pub fn encode_with(dialect: Dialect, out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    match dialect {
        Dialect::A => cola_a::encode_with(out, write),
        Dialect::B => cola_b::encode_with(out, write),
    }
}

/// What the bytes from a possible first byte of a frame turn out to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Probe {
    /// A good frame.
    Frame {
        /// Bytes before the payload.
        header: usize,
        /// Bytes of the payload.
        payload: usize,
        /// Bytes after the payload.
        trailer: usize,
    },
    /// Nothing contradicts a frame so far, but it is not all there. `examined` bytes need not be looked at again.
    Incomplete { examined: usize },
    /// Never was a frame of this dialect: only the first byte is junk.
    NotAFrame,
    /// Looked like a frame and is broken; `extent` is how many bytes it claimed, or seemed to.
    Broken { extent: usize },
}
