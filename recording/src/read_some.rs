//! Reading that a signal does not end.

use std::io::{self, Read};

use crate::read::ReadError;

/// What comes next, as much as there is room for at most; 0 at the end.
pub(crate) fn read_some(input: &mut impl Read, room: &mut [u8]) -> Result<usize, ReadError> {
    loop {
        match input.read(room) {
            Err(cause) if cause.kind() == io::ErrorKind::Interrupted => {}
            other => return other.map_err(ReadError::Io),
        }
    }
}
