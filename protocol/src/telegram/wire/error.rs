//! Why arguments could not be read.

use core::fmt;

/// What was expected, what stood there, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, found {found} at byte {at} of the arguments")]
pub struct WireError {
    /// What the field takes.
    pub expected: &'static str,
    /// What stood there.
    pub found: Found,
    /// Byte offset in the telegram's arguments.
    pub at: usize,
}

/// What stood where a field was expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Found {
    /// Nothing: the arguments ended.
    End,
    /// Text that is no number.
    Text(Excerpt),
    /// A number that does not fit its field; the text of it.
    TooLarge(Excerpt),
    /// A number that makes no sense here.
    Value(u32),
    /// Bytes after the last field.
    Extra(usize),
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::End => f.write_str("the end"),
            Self::Text(text) => write!(f, "\"{text}\""),
            Self::TooLarge(text) => write!(f, "\"{text}\", which is too large,"),
            Self::Value(value) => write!(f, "{value}"),
            Self::Extra(bytes) => write!(f, "{bytes} more bytes"),
        }
    }
}

/// The first bytes of a token, so that an error can quote it without allocating.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Excerpt {
    bytes: [u8; 12],
    len: u8,
}

impl Excerpt {
    pub(crate) fn of(token: &[u8]) -> Self {
        let mut bytes = [0; 12];
        let len = token.len().min(bytes.len());
        bytes.iter_mut().zip(token).for_each(|(to, from)| *to = *from);
        Self { bytes, len: len as u8 }
    }
}

impl fmt::Display for Excerpt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.bytes.get(..usize::from(self.len)).unwrap_or_default().escape_ascii())
    }
}
