//! Telegrams in a stream of bytes: TCP, and files.

use alloc::vec::Vec;

use super::error::{CompactError, Expected};
use super::length::length;
use super::telegram::Telegram;
use super::{HEAD, START};

/// True if `bytes` begin like a telegram of a known type: CoLa B's frames begin with the same four bytes, and then have the high byte of a length.
pub fn begins(bytes: &[u8]) -> bool {
    let Some((START, rest)) = bytes.split_first_chunk().map(|(start, rest)| (*start, rest)) else {
        return false;
    };
    matches!(rest, [1 | 2 | 4, 0, 0, 0, ..])
}

/// True if so few bytes may be the beginning of one.
fn may_begin(bytes: &[u8]) -> bool {
    bytes.iter().enumerate().all(|(at, byte)| match at {
        0..4 => START.get(at) == Some(byte),
        4 => matches!(byte, 1 | 2 | 4),
        _ => *byte == 0,
    })
}

/// What a stretch of the stream is.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// A telegram, with a right CRC.
    Telegram {
        /// Place of its first byte in the stream.
        offset: u64,
        /// Bytes it takes.
        len: usize,
        /// What it says.
        telegram: Telegram,
    },
    /// No telegram.
    Bad {
        /// Place of its first byte in the stream.
        offset: u64,
        /// Bytes up to the next start.
        len: usize,
        /// What is wrong; its place counts from `offset`.
        error: CompactError,
    },
}

/// Finds telegrams in bytes that come in any pieces. What is no telegram is told once, up to the next start or the end, and the search goes on there.
#[derive(Clone, Debug, Default)]
pub struct StreamDecoder {
    bytes: Vec<u8>,
    /// How many of them are passed.
    passed: usize,
    /// Bytes of the stream before them.
    offset: u64,
    /// What is no telegram, and has not met its end.
    bad: Option<Stretch>,
    /// No more bytes will come.
    finished: bool,
}

/// Bytes that are no telegram.
#[derive(Clone, Debug)]
struct Stretch {
    offset: u64,
    len: usize,
    /// Bytes of the telegram that it begins with, where that is whole and does not check.
    claimed: usize,
    error: CompactError,
}

impl StreamDecoder {
    /// Takes the stream's next bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        // Not with every telegram: a file that comes as a whole would be moved as often as it has telegrams.
        self.bytes.drain(..self.passed);
        self.offset += self.passed as u64;
        self.passed = 0;
        self.bytes.extend_from_slice(bytes);
    }

    fn rest(&self) -> &[u8] {
        self.bytes.get(self.passed..).unwrap_or_default()
    }

    /// No more bytes will come: a telegram that is not whole is told as such.
    pub fn finish(&mut self) {
        self.finished = true;
    }

    /// Bytes that wait for what follows them.
    pub fn pending(&self) -> usize {
        self.rest().len()
    }

    /// Of these, bytes of a telegram whose rest may still come: the end of one that is whole and does not check is none.
    pub fn unfinished(&self) -> usize {
        let rest = self.rest();
        let Some(bad) = &self.bad else { return rest.len() };
        let behind = rest.get(bad.claimed.saturating_sub(bad.len)..).unwrap_or_default();
        (0..behind.len()).filter_map(|at| behind.get(at..)).find(|end| may_begin(end)).map_or(0, <[u8]>::len)
    }

    /// The next stretch; none until more bytes come.
    pub fn next_found(&mut self) -> Option<Found> {
        if self.bad.is_none() {
            let rest = self.rest();
            if rest.is_empty() || rest.len() < HEAD && !self.finished {
                return None;
            }
            let mut claimed = 0;
            let error = match length(rest) {
                Ok(Some(len)) => match rest.get(..len).map(Telegram::decode) {
                    Some(Ok(telegram)) => {
                        return Some(Found::Telegram { offset: self.pass(len), len, telegram });
                    }
                    Some(Err(error)) => {
                        claimed = len;
                        error
                    }
                    None if self.finished => ends_early(rest, len),
                    None => return None,
                },
                Ok(None) if self.finished => ends_early(rest, rest.len() + 1),
                Ok(None) => return None,
                Err(error) => error,
            };
            self.bad = Some(Stretch { offset: self.pass(1), len: 1, claimed, error });
        }
        self.end_of_bad()
    }

    fn pass(&mut self, len: usize) -> u64 {
        let offset = self.offset + self.passed as u64;
        self.passed += len;
        offset
    }

    /// The stretch that is no telegram, once the next telegram may begin behind it. However its bytes come, it is one.
    fn end_of_bad(&mut self) -> Option<Found> {
        let rest = self.rest();
        let start = rest.windows(HEAD).position(begins);
        let is_over = start.is_some() || self.finished;
        let more = match start {
            Some(at) => at,
            None if self.finished => rest.len(),
            // The last bytes may be a part of a start: they wait for what follows.
            None => rest.len().saturating_sub(HEAD - 1),
        };
        self.pass(more);
        let bad = self.bad.as_mut()?;
        bad.len += more;
        if !is_over {
            return None;
        }
        self.bad.take().map(|Stretch { offset, len, error, .. }| Found::Bad { offset, len, error })
    }
}

fn ends_early(rest: &[u8], len: usize) -> CompactError {
    let at = rest.len();
    CompactError { expected: Expected::Bytes((len - at) as u64), found: 0, at }
}
