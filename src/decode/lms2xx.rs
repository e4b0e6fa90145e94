//! LMS2xx frames, as serial recordings have them: recognised by their CRC, requests and scans field by field.

use std::ops::Range;

use rowscan_recording::Side;

use rowscan_protocol::frame::STX;
use rowscan_protocol::lms2xx::frame::{
    ACK, FROM_DEVICE, FrameDecoder, Listener, MAX_BODY, NAK, OVERHEAD, Received, checksum, whole,
};
use rowscan_protocol::lms2xx::telegram::Request;
use rowscan_protocol::lms2xx::values::Values;

use super::description::{Description, opaque};
use super::{Entry, MOST_LINES, Options, Piece, Stream, Verdict};

/// How the language is called.
const LANGUAGE: &str = "LMS2xx";

/// The frame `bytes` begin with, and its length. Place and time are the caller's.
pub(super) fn frame(bytes: &[u8], options: Options) -> Option<(usize, Entry)> {
    let length = whole(bytes)?;
    let &[_, address, _, _, command, ..] = bytes else { return None };
    let body = bytes.get(4..length - 2)?;
    let from = if address & FROM_DEVICE == 0 { Side::Host } else { Side::Device };
    let (is, words, fields) = described(from, body, options);
    let entry = Entry {
        from: Some(from),
        dialect: Some(LANGUAGE.to_owned()),
        name: Some(format!("{command:02X}")),
        words: Some(words),
        fields,
        ..Entry::new(&Stream::default(), 0, length as u64, is)
    };
    Some((length, entry))
}

/// The beginning of a telegram that a request has cut off, as the device does.
pub(super) fn cut_off(sent: &[u8]) -> Entry {
    let claimed = match *sent {
        [_, _, low, high, ..] => {
            format!(" of {}", usize::from(u16::from_le_bytes([low, high])) + OVERHEAD)
        }
        _ => String::new(),
    };
    Entry {
        from: Some(Side::Device),
        dialect: Some(LANGUAGE.to_owned()),
        name: sent.get(4).map(|command| format!("{command:02X}")),
        words: Some(format!("cut off by a request: {}{claimed} bytes", sent.len())),
        ..Entry::new(&Stream::default(), 0, sent.len() as u64, Verdict::Opaque)
    }
}

/// A byte that stands alone.
fn mark(byte: u8) -> Entry {
    let words = if byte == ACK { "acknowledged" } else { "not understood" };
    Entry {
        from: Some(Side::Device),
        dialect: Some(LANGUAGE.to_owned()),
        name: Some(format!("{byte:02X}")),
        words: Some(words.to_owned()),
        ..Entry::new(&Stream::default(), 0, 1, Verdict::Telegram)
    }
}

/// Appends all lines of a piece.
pub(super) fn lines(stream: &Stream, piece: &Piece, options: Options, lines: &mut Vec<Entry>) {
    let mut decoder = FrameDecoder::new(Listener::Either);
    decoder.push(&piece.bytes);
    decoder.finish();
    let mut reader = Reader { stream, piece, lines, done: 0 };
    while let Some(received) = decoder.next_received().filter(|_| reader.lines.len() <= MOST_LINES) {
        let (at, len) = match received {
            Received::Frame(frame) => (frame.offset as usize, frame.len),
            Received::CutOff { offset, len } => (offset as usize, len),
            // In the bytes that no frame is found in.
            Received::Broken | Received::Ack | Received::Nak => continue,
        };
        reader.skip_to(at);
        let bytes = piece.bytes.get(at..at + len).unwrap_or_default();
        let entry = frame(bytes, options).map_or_else(|| cut_off(bytes), |(_, entry)| entry);
        reader.put(at..at + len, entry);
    }
    reader.skip_to(piece.bytes.len());
}

struct Reader<'a> {
    stream: &'a Stream,
    piece: &'a Piece,
    lines: &'a mut Vec<Entry>,
    /// Bytes that have a line.
    done: usize,
}

impl Reader<'_> {
    fn put(&mut self, place: Range<usize>, entry: Entry) {
        let (offset, length) = (self.piece.offset + place.start as u64, place.len() as u64);
        let time_s = self.stream.time_of(offset + length);
        let connection = self.stream.connection;
        self.lines.push(Entry { offset, length, time_s, connection, ..entry });
        self.done = place.end;
    }

    fn bad(&mut self, place: Range<usize>, at: usize, expected: String, found: String) {
        let (offset, length) = (self.piece.offset + place.start as u64, place.len() as u64);
        let at = self.piece.offset + at as u64;
        self.lines.push(Entry::bad(self.stream, offset, length, at, expected, found));
        self.done = place.end;
    }

    /// What no frame was found in, up to `end`.
    fn skip_to(&mut self, end: usize) {
        if self.piece.begins_inside && self.done == 0 && end > 0 {
            let words = "the recording begins inside a telegram".to_owned();
            self.put(0..end, Entry { words: Some(words), ..Entry::opaque(self.stream, 0, 0, String::new()) });
        }
        while self.done < end && self.lines.len() <= MOST_LINES {
            let start = self.done;
            let rest = self.piece.bytes.get(start..end).unwrap_or_default();
            match *rest {
                [byte @ (ACK | NAK), ..] => self.put(start..start + 1, mark(byte)),
                [STX, ..] => self.damaged(start, end),
                [byte, ..] => {
                    let starts = rest.iter().position(|byte| *byte == STX).unwrap_or(rest.len());
                    // An acknowledgement right before a frame is one.
                    let acknowledged = starts == rest.len() && matches!(rest, [.., ACK | NAK]);
                    let junk = start..start + starts - usize::from(acknowledged);
                    let expected = format!("{STX:02X}, the start of a frame");
                    self.bad(junk, start, expected, format!("{byte:02X}"));
                }
                [] => return,
            }
        }
    }

    /// A start that no frame follows.
    fn damaged(&mut self, start: usize, end: usize) {
        let bytes = self.piece.bytes.get(start..).unwrap_or_default();
        let next = bytes.iter().skip(1).position(|byte| *byte == STX).map_or(bytes.len(), |at| at + 1);
        let [_, _, low, high, ..] = *bytes else {
            let expected = format!("{} more bytes at least", OVERHEAD + 1 - bytes.len());
            return self.bad(start..end, start + bytes.len(), expected, "the end".to_owned());
        };
        let body = usize::from(u16::from_le_bytes([low, high]));
        if !(1..=MAX_BODY).contains(&body) {
            let (expected, found) = (format!("a length of 1 to {MAX_BODY}"), body.to_string());
            return self.bad(start..end.min(start + next), start + 2, expected, found);
        }
        let extent = body + OVERHEAD;
        match bytes.get(..extent).and_then(<[u8]>::split_last_chunk::<2>) {
            None => {
                let expected = format!("{} more bytes", extent - bytes.len());
                self.bad(start..end, start + bytes.len(), expected, "the end".to_owned());
            }
            Some((summed, crc)) => {
                let (expected, found) = (checksum(summed), u16::from_le_bytes(*crc));
                let place = start..end.min(start + extent);
                self.bad(place, start + extent - 2, format!("CRC {expected:04X}"), format!("{found:04X}"));
            }
        }
    }
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
    let words = std::mem::take(&mut description.words);
    (is, words, options.fields.then(|| description.into_json()))
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

    fn told(bytes: &[u8]) -> Vec<(u64, u64, Verdict, String)> {
        let piece = Piece { bytes: bytes.to_vec(), ..Piece::default() };
        let mut entries = Vec::new();
        lines(&Stream::default(), &piece, Options::default(), &mut entries);
        let words = |entry: &Entry| match (&entry.expected, &entry.found) {
            (Some(expected), Some(found)) => format!("expected {expected}, found {found}"),
            _ => entry.words.clone().unwrap_or_default(),
        };
        entries.iter().map(|entry| (entry.offset, entry.length, entry.is, words(entry))).collect()
    }

    #[test]
    fn a_telegram_that_a_request_cuts_off_is_no_damage() {
        let reply = [0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A];
        let begun = [0x02, 0x80, 0xD6, 0x02, 0xB0, 0x69];
        let told_of = told(&[&begun[..], &[ACK], &reply].concat());
        let expected = "cut off by a request: 6 of 732 bytes".to_owned();
        assert_eq!(told_of[0], (0, 6, Verdict::Opaque, expected));
        assert_eq!(told_of[1], (6, 1, Verdict::Telegram, "acknowledged".to_owned()));
        assert_eq!((told_of[2].0, told_of.len()), (7, 3));
    }

    #[test]
    fn damage_is_told_in_the_language_of_the_line() {
        let reply = [0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A];
        let mut damaged = reply;
        damaged[6] ^= 1;
        let told_of = told(&[&damaged[..], &reply, &[0x55, 0x02, 0x73, 0x03], &reply, &reply[..5]].concat());
        let verdicts: Vec<_> =
            told_of.iter().map(|(offset, length, is, _)| (*offset, *length, *is)).collect();
        use Verdict::{Bad, Opaque};
        let expected =
            [(0, 9, Bad), (9, 9, Opaque), (18, 1, Bad), (19, 3, Bad), (22, 9, Opaque), (31, 5, Bad)];
        assert_eq!(verdicts, expected, "{told_of:?}");
        assert!(told_of[0].3.starts_with("expected CRC "), "{told_of:?}");
        assert_eq!(told_of[5].3, "expected 4 more bytes, found the end");
    }
}
