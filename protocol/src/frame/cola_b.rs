//! CoLa B: four STX, the payload's length, the payload, and one byte of checksum.

use alloc::vec::Vec;

use byteorder::{BigEndian, ByteOrder};

use super::{COMMAND_LETTER, Probe, STX};

/// Four STX.
pub(super) const START: [u8; 4] = [STX; 4];
/// Start and length.
const HEADER: usize = 8;
/// Start, length and checksum.
pub(super) const OVERHEAD: usize = HEADER + 1;

/// The CoLa B checksum: XOR of all payload bytes. Start, length and the checksum itself are not part of it.
///
/// ```
/// use rowscan_protocol::frame::checksum;
/// assert_eq!(checksum(b"sMN Run"), 0x19);
/// ```
pub fn checksum(payload: &[u8]) -> u8 {
    payload.iter().fold(0, |sum, b| sum ^ b)
}

/// Judges the bytes from an STX on. `xor` gives the checksum of a range of `bytes`.
pub(super) fn probe(
    bytes: &[u8],
    max_payload: usize,
    xor: impl FnOnce(core::ops::Range<usize>) -> u8,
) -> Probe {
    let start = bytes.len().min(START.len());
    if bytes.get(..start) != START.get(..start) {
        return Probe::NotAFrame;
    }
    let Some(length) = bytes.get(START.len()..HEADER) else {
        return Probe::Incomplete { examined: start };
    };
    let payload = BigEndian::read_u32(length) as usize;
    if payload == 0 || payload > max_payload {
        return Probe::Broken { extent: HEADER };
    }
    // A false start is known by its ninth byte, long before the length it claims has gone by.
    match bytes.get(HEADER) {
        None => return Probe::Incomplete { examined: HEADER },
        Some(&COMMAND_LETTER) => {}
        Some(_) => return Probe::Broken { extent: HEADER },
    }
    let end = HEADER + payload;
    match bytes.get(end) {
        None => Probe::Incomplete { examined: bytes.len() },
        Some(&sum) if sum == xor(HEADER..end) => Probe::Frame { header: HEADER, payload, trailer: 1 },
        Some(_) => Probe::Broken { extent: end + 1 },
    }
}

pub(super) fn encode_with(out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    out.extend_from_slice(&START);
    let length_at = out.len();
    out.extend_from_slice(&[0; 4]);
    let payload_at = out.len();
    write(out);
    let payload = out.get(payload_at..).unwrap_or_default();
    // A payload of 4 GB does not exist; a length that lies would be refused with the checksum.
    let length = u32::try_from(payload.len()).unwrap_or(u32::MAX);
    let sum = checksum(payload);
    BigEndian::write_u32(&mut out[length_at..], length);
    out.push(sum);
}
