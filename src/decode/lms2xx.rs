//! LMS2xx frames, as serial recordings have them: recognised by their CRC, requests and scans field by field.

use rowscan_recording::Side;

use rowscan_protocol::frame::STX;
use rowscan_protocol::lms2xx::frame::{FROM_DEVICE, MAX_BODY, OVERHEAD, checksum};
use rowscan_protocol::lms2xx::telegram::Request;
use rowscan_protocol::lms2xx::values::Values;

use super::description::{Description, opaque};
use super::{Entry, Options, Stream, Verdict};

/// The frame `bytes` begin with, and its length. Place and time are the caller's.
pub(super) fn frame(bytes: &[u8], options: Options) -> Option<(usize, Entry)> {
    let &[STX, address, low, high, command, ..] = bytes else { return None };
    let length = usize::from(u16::from_le_bytes([low, high]));
    let frame = bytes.get(..length + OVERHEAD).filter(|_| (1..=MAX_BODY).contains(&length))?;
    let (body, crc) = frame.split_last_chunk::<2>()?;
    if u16::from_le_bytes(*crc) != checksum(body) {
        return None;
    }
    let from = if address & FROM_DEVICE == 0 { Side::Host } else { Side::Device };
    let (is, words, fields) = described(from, body.get(4..).unwrap_or_default(), options);
    let entry = Entry {
        from: Some(from),
        dialect: Some("LMS2xx".to_owned()),
        name: Some(format!("{command:02X}")),
        words: Some(words),
        fields,
        ..Entry::new(&Stream::default(), 0, frame.len() as u64, is)
    };
    Some((frame.len(), entry))
}

/// What a frame's body says, in words and as JSON, and whether it was taken apart.
fn described(from: Side, body: &[u8], options: Options) -> (Verdict, String, Option<serde_json::Value>) {
    let mut description = Description::new(options.values);
    let mut values = Values::default();
    let whole = || (Verdict::Opaque, opaque(body.len().saturating_sub(1)), None);
    match (from, Request::parse(body)) {
        (Side::Host, Request::Unknown(_)) => return whole(),
        (Side::Host, request) => request.visit(&mut description),
        (Side::Device, _) if values.decode_into(body).is_ok() => values.visit(&mut description),
        (Side::Device, _) => return whole(),
    }
    let is = if description.is_opaque { Verdict::Opaque } else { Verdict::Telegram };
    (is, std::mem::take(&mut description.words), Some(description.into_json()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_frames_are_recognised_and_a_wrong_crc_is_not() {
        // Status request; mode change done (telegram listing of the LMS2xx).
        let request = [0x02, 0x00, 0x01, 0x00, 0x31, 0x15, 0x12, 0xFF];
        let (len, entry) = frame(&request, Options::default()).unwrap();
        assert_eq!((len, entry.from, entry.name.as_deref()), (7, Some(Side::Host), Some("31")));
        assert_eq!(entry.is, Verdict::Telegram);
        let reply = [0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A];
        // A reply that is not taken apart.
        let (_, entry) = frame(&reply, Options::default()).unwrap();
        assert_eq!((entry.from, entry.is), (Some(Side::Device), Verdict::Opaque));
        assert_eq!(frame(&[0x02, 0x00, 0x01, 0x00, 0x31, 0x15, 0x13], Options::default()), None);
        assert_eq!(frame(&request[..6], Options::default()), None);
    }
}
