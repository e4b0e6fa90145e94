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

/// Finds telegrams in bytes that come in any pieces. What is no telegram is told, and the search goes on at the next start behind it.
#[derive(Clone, Debug, Default)]
pub struct StreamDecoder {
    bytes: Vec<u8>,
    /// How many of them are told.
    told: usize,
    /// Bytes of the stream before them.
    offset: u64,
    /// No more bytes will come.
    finished: bool,
}

impl StreamDecoder {
    /// Takes the stream's next bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        // Not with every telegram: a file that comes as a whole would be moved as often as it has telegrams.
        self.bytes.drain(..self.told);
        self.offset += self.told as u64;
        self.told = 0;
        self.bytes.extend_from_slice(bytes);
    }

    fn rest(&self) -> &[u8] {
        self.bytes.get(self.told..).unwrap_or_default()
    }

    /// No more bytes will come: a telegram that is not whole is told as such.
    pub fn finish(&mut self) {
        self.finished = true;
    }

    /// Bytes that are not told yet.
    pub fn pending(&self) -> usize {
        self.rest().len()
    }

    /// The next stretch; none until more bytes come.
    pub fn next_found(&mut self) -> Option<Found> {
        let rest = self.rest();
        if rest.is_empty() {
            return None;
        }
        let error = match length(rest) {
            Ok(Some(len)) => match rest.get(..len).map(Telegram::decode) {
                Some(Ok(telegram)) => return Some(Found::Telegram { offset: self.take(len), len, telegram }),
                Some(Err(error)) => error,
                None if self.finished => ends_early(rest, len),
                None => return None,
            },
            Ok(None) if self.finished => ends_early(rest, rest.len() + 1),
            Ok(None) => return None,
            Err(error) => error,
        };
        let len = self.next_start()?;
        Some(Found::Bad { offset: self.take(len), len, error })
    }

    fn take(&mut self, len: usize) -> u64 {
        let offset = self.offset + self.told as u64;
        self.told += len;
        offset
    }

    /// Bytes to where the next telegram may begin; none while it may begin in bytes that have not come.
    fn next_start(&self) -> Option<usize> {
        let rest = self.rest();
        let found = rest.get(1..)?.windows(HEAD).position(begins).map(|at| at + 1);
        match found {
            Some(at) => Some(at),
            None if self.finished => Some(rest.len()),
            // The last bytes may be a part of a start: they wait for what follows.
            None if rest.len() >= 2 * HEAD => Some(rest.len() - (HEAD - 1)),
            None => None,
        }
    }
}

fn ends_early(rest: &[u8], len: usize) -> CompactError {
    let at = rest.len();
    CompactError { expected: Expected::Bytes((len - at) as u64), found: 0, at }
}
