//! Telegrams of one direction of a connection, as they come.

use rowscan_protocol::frame::{Accept, FrameDecoder};

use super::{Entry, MAX_PAYLOAD, Options, Piece, Stream};

/// Reads on where it stopped. What is no telegram is passed over.
#[derive(Debug)]
pub struct Follow {
    decoder: FrameDecoder,
    stream: Stream,
    piece: Piece,
}

impl Default for Follow {
    fn default() -> Self {
        let decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
        Self { decoder, stream: Stream::default(), piece: Piece::default() }
    }
}

impl Follow {
    /// The telegrams that end in `bytes`.
    pub fn read(&mut self, bytes: &[u8]) -> Vec<Entry> {
        self.decoder.push(bytes);
        let mut entries = Vec::new();
        while let Some(frame) = self.decoder.next_frame() {
            entries.push(self.stream.telegram(&self.piece, &frame, Options::default()));
        }
        entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn telegrams_are_read_however_their_bytes_are_cut() {
        let bytes = b"\x02sRN DeviceIdent\x03\x02sMN Run\x03";
        for cut in 0..bytes.len() {
            let mut follow = Follow::default();
            let mut read = follow.read(&bytes[..cut]);
            read.extend(follow.read(&bytes[cut..]));
            let names: Vec<_> = read.iter().filter_map(|entry| entry.name.as_deref()).collect();
            assert_eq!(names, ["DeviceIdent", "Run"], "cut at {cut}");
        }
    }
}
