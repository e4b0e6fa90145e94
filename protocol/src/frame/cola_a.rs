//! CoLa A: text between STX and ETX.

use alloc::vec::Vec;

use super::{COMMAND_LETTER, ETX, Probe, STX};

/// Judges the bytes from an STX on. The first `examined` bytes are known to hold no ETX and no further STX.
pub(super) fn probe(bytes: &[u8], examined: usize, max_payload: usize) -> Probe {
    match bytes.get(1) {
        None => return Probe::Incomplete { examined: 1 },
        Some(&COMMAND_LETTER) => {}
        Some(_) => return Probe::NotAFrame,
    }
    let examined = examined.max(2);
    // An STX inside the text means that the frame before it lost its end.
    let stop = find_mark(bytes.get(examined..).unwrap_or_default()).map(|i| i + examined);
    match stop {
        Some(at) if at - 1 > max_payload => Probe::Broken { extent: at },
        Some(at) if bytes.get(at) == Some(&ETX) => Probe::Frame { header: 1, payload: at - 1, trailer: 1 },
        Some(at) => Probe::Broken { extent: at },
        None if bytes.len() - 1 > max_payload => Probe::Broken { extent: bytes.len() },
        None => Probe::Incomplete { examined: bytes.len() },
    }
}

/// Index of the first STX or ETX.
fn find_mark(bytes: &[u8]) -> Option<usize> {
    // The two marks differ in the lowest bit only.
    let is_mark = |b: &u8| b & !1 == STX;
    let mut at = 0;
    for block in bytes.chunks(64) {
        // Without an early exit the compiler looks at the whole block at once.
        if block.iter().fold(false, |hit, b| hit | is_mark(b)) {
            return block.iter().position(is_mark).map(|i| at + i);
        }
        at += block.len();
    }
    None
}

pub(super) fn encode_with(out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    out.push(STX);
    write(out);
    out.push(ETX);
}
