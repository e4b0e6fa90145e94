//! How long a telegram is, by its beginning: for streams, which have no datagrams.

use super::error::{CompactError, Expected};
use super::shape::{MAX_MODULES, Shape, Version};
use super::wire::{Fields, Reader};
use super::{HEAD, START, TAIL};

/// Longest telegram that is waited for, bytes. The longest real one is that of an LRS4000 at 0.02°: 100 000.
pub const MAX_TELEGRAM: usize = 256 * 1024;
/// A whole telegram of type 2.
const IMU: usize = 64;
/// A whole telegram of type 4.
const ENCODER: usize = 88;

/// How many bytes the telegram takes that `bytes` begin with; none if there are too few of them to tell. The CRC is not looked at.
///
/// # Errors
/// No telegram begins like that, or it would be longer than [`MAX_TELEGRAM`].
pub fn length(bytes: &[u8]) -> Result<Option<usize>, CompactError> {
    if let Some(at) = bytes.iter().zip(START).position(|(found, expected)| *found != expected) {
        let found = bytes.iter().take(START.len()).fold(0, |word, byte| word << 8 | u64::from(*byte));
        return Err(CompactError { expected: Expected::Start, found, at });
    }
    match number(bytes, START.len()) {
        None => Ok(None),
        Some(1) => scan(bytes),
        Some(2) => Ok(Some(IMU)),
        Some(4) => Ok(Some(ENCODER)),
        Some(other) => Err(CompactError { expected: Expected::Type, found: other.into(), at: START.len() }),
    }
}

fn number(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().copied().map(u32::from_le_bytes)
}

/// A scan's modules each say how long the next one is.
fn scan(bytes: &[u8]) -> Result<Option<usize>, CompactError> {
    // Behind counter and time.
    const VERSION: usize = HEAD + 16;
    // In a module, behind two counters and the sender.
    const SHAPE: usize = 20;
    const LINES: usize = SHAPE + 12;
    let Some(version) = number(bytes, VERSION) else { return Ok(None) };
    let version = Version::of(version, VERSION)?;
    let Some(mut size) = number(bytes, VERSION + 4) else { return Ok(None) };
    let mut end = VERSION + 8;
    let mut modules = 0;
    while size > 0 {
        if modules == MAX_MODULES {
            return Err(CompactError { expected: Expected::Modules, found: modules as u64 + 1, at: end });
        }
        let after = end.saturating_add(size as usize);
        if after > MAX_TELEGRAM - TAIL {
            let (expected, found) = (Expected::Length(MAX_TELEGRAM as u64), (after + TAIL) as u64);
            return Err(CompactError { expected, found, at: end });
        }
        let mut shape = Shape::default();
        let mut reader = Reader::new(bytes, end + SHAPE);
        if reader.left() < LINES - SHAPE {
            return Ok(None);
        }
        shape.read(&mut reader)?;
        let scale = if version == Version::V4 { 4 } else { 0 };
        let next = end + LINES + 28 * shape.lines as usize + scale;
        if next + 8 > after {
            let expected = Expected::ModuleSize((next + 8 - end) as u64);
            return Err(CompactError { expected, found: size.into(), at: end });
        }
        let Some(following) = number(bytes, next) else { return Ok(None) };
        (size, end) = (following, after);
        modules += 1;
    }
    Ok(Some(end + TAIL))
}
