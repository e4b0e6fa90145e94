//! Telegrams of one direction of a connection, as they come.

use rowscan_protocol::compact::StreamDecoder;
use rowscan_protocol::frame::{Accept, FrameDecoder};
use rowscan_protocol::lms2xx::frame::{self as serial, Listener, Received};
use rowscan_recording::{MAX_PAYLOAD, StreamKind};

use super::{Entry, Options, Piece, Stream, compact, lms2xx};

/// Reads on where it stopped. What is no telegram is passed over.
#[derive(Debug)]
pub struct Follow {
    decoder: Decoder,
    stream: Stream,
    piece: Piece,
}

#[derive(Debug)]
enum Decoder {
    Cola(FrameDecoder),
    /// With the bytes that it has, and how many came before them.
    Lms2xx(serial::FrameDecoder, Vec<u8>, u64),
    Compact(StreamDecoder),
}

impl Follow {
    /// Of a stream of this kind.
    pub fn of(kind: StreamKind) -> Self {
        let decoder = match kind {
            StreamKind::Lms2xx => Decoder::Lms2xx(serial::FrameDecoder::new(Listener::Either), Vec::new(), 0),
            StreamKind::Compact => Decoder::Compact(StreamDecoder::default()),
            _ => Decoder::Cola(FrameDecoder::new(Accept::Either, MAX_PAYLOAD)),
        };
        Self { decoder, stream: Stream::default(), piece: Piece::default() }
    }

    /// The telegrams that end in `bytes`.
    pub fn read(&mut self, bytes: &[u8]) -> Vec<Entry> {
        let mut entries = Vec::new();
        match &mut self.decoder {
            Decoder::Cola(decoder) => {
                decoder.push(bytes);
                while let Some(frame) = decoder.next_frame() {
                    entries.push(self.stream.telegram(&self.piece, &frame, Options::default()));
                }
            }
            Decoder::Compact(decoder) => {
                decoder.push(bytes);
                entries.extend(compact::telegrams(decoder));
            }
            Decoder::Lms2xx(decoder, kept, before) => {
                decoder.push(bytes);
                kept.extend_from_slice(bytes);
                while let Some(received) = decoder.next_received() {
                    let (at, len) = match received {
                        Received::Frame(frame) => (frame.offset, frame.len),
                        Received::CutOff { offset, len } => (offset, len),
                        Received::Broken | Received::Ack | Received::Nak => continue,
                    };
                    let at = (at - *before) as usize;
                    let sent = kept.get(at..at + len).unwrap_or_default();
                    let whole = lms2xx::frame(sent, Options::default());
                    entries.push(whole.map_or_else(|| lms2xx::cut_off(sent), |(_, entry)| entry));
                }
                let done = kept.len() - decoder.pending();
                kept.drain(..done);
                *before += done as u64;
            }
        }
        entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn telegrams_are_read_however_their_bytes_are_cut() {
        let cola = b"\x02sRN DeviceIdent\x03\x02sMN Run\x03".to_vec();
        let reply = [0x02, 0x80, 0x03, 0x00, 0xA0, 0x00, 0x10, 0x16, 0x0A];
        // A scan that a request has cut off behind six bytes; what would be the rest of it comes as replies.
        let begun = |claimed| [&[0x02, 0x80, claimed, 0x00, 0xB0, 0x69, 0x06][..], &reply, &reply].concat();
        for (kind, bytes, expected) in [
            (StreamKind::Cola, cola, &["DeviceIdent", "Run"][..]),
            (StreamKind::Lms2xx, begun(18), &["B0", "A0", "A0"]),
            // The rest of it would end inside the first reply.
            (StreamKind::Lms2xx, begun(6), &["B0", "A0", "A0"]),
        ] {
            for cut in 0..bytes.len() {
                let mut follow = Follow::of(kind);
                let mut read = follow.read(&bytes[..cut]);
                read.extend(follow.read(&bytes[cut..]));
                let names: Vec<_> = read.iter().filter_map(|entry| entry.name.as_deref()).collect();
                assert_eq!(names, expected, "{kind} cut at {cut}");
            }
        }
    }
}
