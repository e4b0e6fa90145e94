//! A recording laid out for decoding: each direction of each stream as one run of bytes.

use rowscan_recording::{Format, Joint, Packet, ReadError, Recording, Side, StreamKind, Torn};

use super::{Entry, MOST_LINES, Piece, Stream, TooLong, Verdict};

/// Why there is nothing to decode.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// There is too much of it.
    #[error(transparent)]
    TooLong(#[from] TooLong),
}

/// Bytes to decode.
#[derive(Debug)]
pub struct Input {
    format: Format,
    /// Streams that belong together: both directions of a connection.
    connections: Vec<Vec<Stream>>,
    /// Packets that are no telegrams, one entry each.
    others: Vec<Entry>,
    torn: Option<Entry>,
}

impl Input {
    /// Reads a recording to its end.
    ///
    /// # Errors
    /// It cannot be read, or holds more than can be decoded at once: so many bytes, or [`MOST_LINES`](super::MOST_LINES) packets of other streams.
    pub fn read(mut recording: Recording, most_bytes: u64) -> Result<Self, InputError> {
        let format = recording.format();
        let numbered = matches!(format, Format::Capture | Format::Mcap);
        let mut connections: Vec<Vec<Stream>> = Vec::new();
        let mut others = Vec::new();
        let mut bytes = 0;
        while let Some(packet) = recording.next_packet()? {
            bytes += packet.bytes.len() as u64;
            if bytes > most_bytes || others.len() > MOST_LINES {
                return Err(TooLong.into());
            }
            let number = u32::try_from(packet.stream + 1).unwrap_or(u32::MAX);
            let connection = numbered.then_some(number);
            let began_ns = recording.began_ns();
            let kind = recording.streams().get(packet.stream).map_or(StreamKind::Bytes, |stream| stream.kind);
            if !kind.is_scanner() {
                others.push(other(kind, number, began_ns, &packet));
                continue;
            }
            if connections.len() <= packet.stream {
                let pair = || {
                    let stream = |_| Stream { connection, kind, ..Stream::default() };
                    [Side::Host, Side::Device].map(stream).into()
                };
                connections.resize_with(packet.stream + 1, pair);
            }
            let side = usize::from(packet.from == Some(Side::Device));
            if let Some(stream) = connections.get_mut(packet.stream).and_then(|pair| pair.get_mut(side)) {
                stream.push(packet, began_ns);
            }
        }
        // Of bytes as they are, the last line says it.
        let torn =
            recording.torn().filter(|_| !matches!(format, Format::Raw | Format::Hex)).map(|torn| Entry {
                words: Some(
                    match torn.resumed {
                        None => "the file is broken here",
                        Some(_) => "the file is damaged here, and read on behind it",
                    }
                    .to_owned(),
                ),
                error_offset: Some(torn.offset),
                expected: Some(torn.expected.to_owned()),
                found: Some(torn.found.clone()),
                ..Entry::new(&Stream::default(), torn.offset, missing(torn, bytes), Verdict::Bad)
            });
        Ok(Self { format, connections, others, torn })
    }

    /// True for a network capture, of which only the connections with telegrams are wanted.
    pub(super) fn is_capture(&self) -> bool {
        self.format == Format::Capture
    }

    /// Streams that belong together.
    pub(super) fn connections(&self) -> &[Vec<Stream>] {
        &self.connections
    }

    /// Packets of other streams.
    pub(super) fn others(&self) -> &[Entry] {
        &self.others
    }

    /// Where the file breaks off.
    pub(super) fn torn(&self) -> Option<Entry> {
        self.torn.clone()
    }
}

/// A CAN frame, a sentence, or bytes of unknown kind.
fn other(kind: StreamKind, number: u32, began_ns: Option<u64>, packet: &Packet) -> Entry {
    let text = String::from_utf8_lossy(&packet.bytes).trim().escape_default().to_string();
    let (dialect, words) = match kind {
        StreamKind::Can => ("CAN", text),
        StreamKind::Nmea => ("NMEA", text),
        StreamKind::Cola | StreamKind::Lms2xx | StreamKind::Compact | StreamKind::Bytes => {
            ("bytes", super::description::opaque(packet.bytes.len()))
        }
    };
    Entry {
        connection: Some(number),
        time_s: since(began_ns, packet.at_ns),
        from: packet.from,
        dialect: Some(dialect.to_owned()),
        words: Some(words),
        ..Entry::new(&Stream::default(), 0, packet.bytes.len() as u64, Verdict::Opaque)
    }
}

/// Bytes that cannot be read, of a file with so many in its packets.
fn missing(torn: &Torn, bytes: u64) -> u64 {
    torn.resumed.map_or_else(|| bytes.saturating_sub(torn.offset), |resumed| resumed.bytes)
}

fn since(began_ns: Option<u64>, at_ns: Option<u64>) -> Option<f64> {
    Some(at_ns?.saturating_sub(began_ns?) as f64 * 1e-9)
}

impl Stream {
    fn push(&mut self, packet: Packet, began_ns: Option<u64>) {
        let end = self.pieces.last().map_or(0, |piece| piece.offset + piece.bytes.len() as u64);
        match (packet.joint, self.pieces.last_mut()) {
            (Joint::Seamless, Some(piece)) => piece.bytes.extend_from_slice(&packet.bytes),
            (joint, _) => {
                let (missing_before, packets) = match joint {
                    Joint::Gap { bytes, packets } => (bytes, packets),
                    _ => (0, 0),
                };
                self.pieces.push(Piece {
                    offset: end + missing_before,
                    bytes: packet.bytes,
                    missing_before,
                    missing_packets: packets,
                    begins_inside: joint == Joint::Inside,
                });
            }
        }
        if let Some(time_s) = since(began_ns, packet.at_ns) {
            let end = self.pieces.last().map_or(0, |piece| piece.offset + piece.bytes.len() as u64);
            self.times.push((end, time_s));
        }
    }
}
