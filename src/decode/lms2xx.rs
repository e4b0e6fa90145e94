//! LMS2xx frames, which turn up in serial recordings: recognised by their CRC and listed, not taken apart.

use rowscan_recording::Side;

use super::{Line, Stream, Verdict, words};

/// `02`, address, length (two bytes, low first), command, data, CRC (two bytes, low first).
const OVERHEAD: usize = 6;
const STX: u8 = 0x02;
/// The device's own address; a host writes the one of the device, 0.
const FROM_DEVICE: u8 = 0x80;
/// Largest length the manual allows.
const MOST: usize = 812;

/// The frame `bytes` begin with, and its length. Place and time are the caller's.
pub(super) fn frame(bytes: &[u8]) -> Option<(usize, Line)> {
    let &[STX, address, low, high, command, ..] = bytes else { return None };
    let length = usize::from(u16::from_le_bytes([low, high]));
    let frame = bytes.get(..length + OVERHEAD).filter(|_| (1..=MOST).contains(&length))?;
    let (body, crc) = frame.split_last_chunk::<2>()?;
    if u16::from_le_bytes(*crc) != checksum(body) {
        return None;
    }
    let from = if address & FROM_DEVICE == 0 { Side::Host } else { Side::Device };
    let line = Line {
        from: Some(from),
        dialect: Some("LMS2xx".to_owned()),
        name: Some(format!("{command:02X}")),
        words: Some(words::opaque(length - 1)),
        ..Line::new(&Stream::default(), 0, frame.len() as u64, Verdict::Opaque)
    };
    Some((frame.len(), line))
}

/// SICK's CRC: polynomial 8005, two data bytes go into every step.
fn checksum(bytes: &[u8]) -> u16 {
    let mut previous = 0;
    bytes.iter().fold(0, |crc: u16, &byte| {
        let shifted = crc << 1;
        let reduced = if crc & 0x8000 == 0 { shifted } else { shifted ^ 0x8005 };
        reduced ^ u16::from_be_bytes([std::mem::replace(&mut previous, byte), byte])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_frames_are_recognised_and_a_wrong_crc_is_not() {
        // Status request; mode change done (telegram listing of the LMS2xx).
        let request = [0x02, 0x00, 0x01, 0x00, 0x31, 0x15, 0x12, 0xFF];
        let (len, line) = frame(&request).unwrap();
        assert_eq!((len, line.from, line.name.as_deref()), (7, Some(Side::Host), Some("31")));
        let reply = [0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A];
        assert_eq!(frame(&reply).unwrap().1.from, Some(Side::Device));
        assert_eq!(frame(&[0x02, 0x00, 0x01, 0x00, 0x31, 0x15, 0x13]), None);
        assert_eq!(frame(&request[..6]), None);
    }
}
