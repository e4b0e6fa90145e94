//! Why bytes are no Compact telegram, and why a telegram has no bytes.

use core::fmt;

use super::shape::{MAX_BEAMS, MAX_ECHOES, MAX_LINES, MAX_MODULES};

/// What was expected, what stood there, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CompactError {
    /// What should stand there.
    pub expected: Expected,
    /// The number that stands there; bytes where bytes are missing or left over.
    pub found: u64,
    /// Offset in the telegram, from its first byte.
    pub at: usize,
}

/// What a place in a telegram takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Expected {
    /// `02 02 02 02`.
    Start,
    /// A type that is taken apart.
    Type,
    /// A version of a scan.
    Version,
    /// This number and no other.
    Number(u32),
    /// The length of an encoder's fields.
    PayloadLength,
    /// So many bytes more, or more than that.
    Bytes(u64),
    /// The CRC of the bytes before it.
    Crc(u32),
    /// How many lines a module has.
    Lines,
    /// How many beams a line has.
    Beams,
    /// How many echoes a beam has.
    Echoes,
    /// The size of a module by its counts.
    ModuleSize(u64),
    /// One more module at most, or none.
    Modules,
    /// A telegram that is no longer than this.
    Length(u64),
    /// Nothing more.
    End,
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start => f.write_str("02020202, the start of a Compact telegram"),
            Self::Type => f.write_str("type 1 (scan), 2 (IMU) or 4 (encoder)"),
            Self::Version => f.write_str("version 3 or 4 of a scan"),
            Self::Number(number) => write!(f, "{number}"),
            Self::PayloadLength => f.write_str("52 bytes of payload (48 where the sender is not counted)"),
            Self::Bytes(bytes) => write!(f, "{bytes} more bytes"),
            Self::Crc(crc) => write!(f, "CRC {crc:08X}"),
            Self::Lines => write!(f, "1 to {MAX_LINES} lines"),
            Self::Beams => write!(f, "at most {MAX_BEAMS} beams"),
            Self::Echoes => write!(f, "1 to {MAX_ECHOES} echoes"),
            Self::ModuleSize(bytes) => write!(f, "a module of {bytes} bytes by its counts"),
            Self::Modules => write!(f, "at most {MAX_MODULES} modules"),
            Self::Length(bytes) => write!(f, "a telegram of at most {bytes} bytes"),
            Self::End => f.write_str("the end"),
        }
    }
}

impl CompactError {
    /// What stands there, in words.
    pub fn found(&self) -> impl fmt::Display + use<> {
        Words { expected: self.expected, found: self.found }
    }
}

struct Words {
    expected: Expected,
    found: u64,
}

impl fmt::Display for Words {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.expected {
            Expected::Crc(_) | Expected::Start => write!(f, "{:08X}", self.found),
            Expected::Bytes(_) => write!(f, "{}", self.found),
            Expected::End => write!(f, "{} more bytes", self.found),
            _ => write!(f, "{}", self.found),
        }
    }
}

impl fmt::Display for CompactError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected {}, found {} at byte {} of the telegram", self.expected, self.found(), self.at)
    }
}

impl core::error::Error for CompactError {}

/// A telegram whose parts contradict each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{part}: expected {expected}, found {found}; `ScanTelegram::seal` sets counts and sizes")]
pub struct EncodeError {
    /// Which part.
    pub part: &'static str,
    /// How many, or how much, it should have.
    pub expected: u64,
    /// What it has.
    pub found: u64,
}
