//! Recorded bytes field by field: which telegrams a file holds, what is in them, and where it is damaged.
//!
//! A recording (`rowscan_recording`) becomes streams, a stream becomes entries. Nothing ends the work: what is no telegram is located
//! and the search goes on behind it.

mod compact;
mod description;
mod filter;
mod follow;
mod input;
mod lms2xx;

use std::ops::Range;

use rowscan_protocol::device::command;
use rowscan_protocol::frame::{Accept, Dialect, Frame, FrameDecoder, fault};
use rowscan_protocol::telegram::Telegram;
use rowscan_recording::{MAX_PAYLOAD, Side, StreamKind};
use serde::Serialize;

use description::Description;
pub use filter::Filter;
pub use follow::Follow;
pub use input::{Input, InputError};

/// Most lines of one transcript: all of them are held at once, to be put in order.
pub const MOST_LINES: usize = 2_000_000;

/// What a stretch of bytes turned out to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// A telegram, all of whose fields have names.
    Telegram,
    /// A good frame with a body that is not taken apart, or fill bytes between frames.
    Opaque,
    /// No frame, or a telegram that cannot be read to its end.
    Bad,
}

/// One telegram, or one stretch of bytes that is none.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// Which TCP connection of a capture or stream of a recording, from 1 on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub connection: Option<u32>,
    /// Seconds since the capture began, when the last byte had come.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Place of the first byte in its stream: in the file, or in one direction of the connection.
    pub offset: u64,
    /// Bytes it takes.
    pub length: u64,
    /// Who sent it, as far as that can be told.
    pub from: Option<Side>,
    /// What it is.
    pub is: Verdict,
    /// `CoLa A`, `CoLa B`, `LMS2xx`, `Compact`.
    pub dialect: Option<String>,
    /// The telegram's first three letters.
    pub kind: Option<&'static str>,
    /// The command's name.
    pub name: Option<String>,
    /// What it holds, for people.
    pub words: Option<String>,
    /// What it holds, as an object with every field and value; none for what is not taken apart.
    pub fields: Option<serde_json::Value>,
    /// Where it is wrong, counted as `offset`.
    pub error_offset: Option<u64>,
    /// What should stand there.
    pub expected: Option<String>,
    /// What stands there.
    pub found: Option<String>,
}

impl Entry {
    fn new(stream: &Stream, offset: u64, length: u64, is: Verdict) -> Self {
        Self {
            connection: stream.connection,
            time_s: stream.time_of(offset + length),
            offset,
            length,
            from: None,
            is,
            dialect: None,
            kind: None,
            name: None,
            words: None,
            fields: None,
            error_offset: None,
            expected: None,
            found: None,
        }
    }

    fn opaque(stream: &Stream, offset: u64, length: u64, words: String) -> Self {
        Self { words: Some(words), ..Self::new(stream, offset, length, Verdict::Opaque) }
    }

    fn bad(stream: &Stream, offset: u64, length: u64, at: u64, expected: String, found: String) -> Self {
        Self {
            error_offset: Some(at),
            expected: Some(expected),
            found: Some(found),
            ..Self::new(stream, offset, length, Verdict::Bad)
        }
    }
}

/// Bytes of one direction, in order.
#[derive(Clone, Debug, Default)]
pub struct Stream {
    /// Which TCP connection of a capture.
    connection: Option<u32>,
    /// The language of its bytes.
    kind: StreamKind,
    pieces: Vec<Piece>,
    /// Offset behind the last byte of a packet, and when it came, in order.
    times: Vec<(u64, f64)>,
}

/// Bytes without a gap.
#[derive(Clone, Debug, Default)]
struct Piece {
    offset: u64,
    bytes: Vec<u8>,
    /// Bytes before it that should be there and are not.
    missing_before: u64,
    /// Packets before it that should be there and are not, where their bytes are not known.
    missing_packets: u64,
    /// It may begin inside a telegram.
    begins_inside: bool,
}

impl Stream {
    fn time_of(&self, end: u64) -> Option<f64> {
        let packet = self.times.partition_point(|(packet_end, _)| *packet_end < end);
        self.times.get(packet).or(self.times.last()).map(|(_, time)| *time)
    }

    fn lines(&self, options: Options) -> Vec<Entry> {
        let mut lines = Vec::new();
        for piece in &self.pieces {
            if piece.missing_before > 0 || piece.missing_packets > 0 {
                let at = piece.offset - piece.missing_before;
                let expected = match piece.missing_before {
                    0 => format!("{} more packets", piece.missing_packets),
                    bytes => format!("{bytes} more bytes"),
                };
                lines.push(Entry::bad(
                    self,
                    at,
                    piece.missing_before,
                    at,
                    expected,
                    "none in the recording".to_owned(),
                ));
            }
            match self.kind {
                StreamKind::Lms2xx => lms2xx::lines(self, piece, options, &mut lines),
                StreamKind::Compact => compact::lines(self, piece, options, &mut lines),
                _ => self.piece_lines(piece, options, &mut lines),
            }
        }
        if self.connection.is_some() {
            // One direction of a connection has one sender.
            let from = lines.iter().find_map(|line| line.from);
            lines.iter_mut().for_each(|line| line.from = from);
        }
        lines
    }

    fn piece_lines(&self, piece: &Piece, options: Options, lines: &mut Vec<Entry>) {
        let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
        decoder.push(&piece.bytes);
        decoder.finish();
        let mut done = 0;
        while let Some(frame) = decoder.next_frame().filter(|_| lines.len() <= MOST_LINES) {
            let start = frame.offset as usize;
            if lies_in_lms2xx(&piece.bytes, done, &frame) {
                continue;
            }
            self.skipped(piece, done..start, options, lines);
            lines.push(self.telegram(piece, &frame, options));
            done = start + frame.len;
        }
        self.skipped(piece, done..piece.bytes.len(), options, lines);
    }

    /// What no frame was found in.
    fn skipped(&self, piece: &Piece, mut skipped: Range<usize>, options: Options, lines: &mut Vec<Entry>) {
        let place = |range: &Range<usize>| (piece.offset + range.start as u64, range.len() as u64);
        while !skipped.is_empty() && lines.len() <= MOST_LINES {
            let bytes = piece.bytes.get(skipped.clone()).unwrap_or_default();
            let fill = bytes.iter().take_while(|&&b| b == 0).count();
            let inside = piece.begins_inside && skipped.start == 0;
            let end = if let Some((len, mut line)) = lms2xx::frame(bytes, options) {
                let (offset, length) = place(&(skipped.start..skipped.start + len));
                line = Entry { offset, length, time_s: self.time_of(offset + length), ..line };
                lines.push(line);
                skipped.start + len
            } else if fill > 0 {
                // MRPT sends a NUL after every frame, which devices ignore.
                let (offset, length) = place(&(skipped.start..skipped.start + fill));
                lines.push(Entry::opaque(self, offset, length, format!("{fill} fill bytes")));
                skipped.start + fill
            } else {
                let Some(fault) = fault(&piece.bytes, skipped.clone(), MAX_PAYLOAD) else { return };
                let (offset, length) = place(&fault.bytes);
                lines.push(if inside {
                    let words = "the recording begins inside a telegram".to_owned();
                    Entry::opaque(self, offset, length, words)
                } else {
                    let at = piece.offset + fault.at as u64;
                    Entry::bad(self, offset, length, at, fault.kind.expected(), fault.kind.found())
                });
                fault.bytes.end
            };
            skipped.start = end;
        }
    }

    fn telegram(&self, piece: &Piece, frame: &Frame<'_>, options: Options) -> Entry {
        let offset = piece.offset + frame.offset;
        let line = Entry {
            dialect: Some(frame.dialect.to_string()),
            ..Entry::new(self, offset, frame.len as u64, Verdict::Telegram)
        };
        // A frame ends in one byte behind its payload, in either dialect.
        let payload_at = offset + (frame.len - 1 - frame.payload.len()) as u64;
        let bad = |line: Entry, at: u64, expected: String, found: String| Entry {
            is: Verdict::Bad,
            error_offset: Some(at),
            expected: Some(expected),
            found: Some(found),
            ..line
        };
        let telegram = match Telegram::parse(frame.dialect, frame.payload) {
            Ok(telegram) => telegram,
            Err(error) => {
                let expected = "a command such as \"sRN name\"".to_owned();
                return bad(line, payload_at, expected, format!("\"{}\"", error.found));
            }
        };
        let line = Entry {
            from: Some(Side::of(telegram.kind)),
            kind: Some(telegram.kind.letters()),
            name: (!telegram.name.is_empty()).then(|| telegram.name.to_owned()),
            ..line
        };
        let args = telegram.args.bytes.len();
        let mut description = Description::new(options.values);
        match command::visit(&telegram, &mut description) {
            Some(Ok(())) => {
                let is = if description.is_opaque { Verdict::Opaque } else { Verdict::Telegram };
                let words = Some(std::mem::take(&mut description.words));
                Entry { is, words, fields: options.fields.then(|| description.into_json()), ..line }
            }
            Some(Err(error)) => {
                let at = payload_at + (frame.payload.len() - args + error.at) as u64;
                bad(line, at, error.expected.to_owned(), error.found.to_string())
            }
            None if args == 0 => Entry { words: Some(String::new()), ..line },
            None => Entry { is: Verdict::Opaque, words: Some(description::opaque(args)), ..line },
        }
    }
}

/// True if what looks like a frame of CoLa A, and is no telegram, is a part of a valid LMS2xx telegram: two bytes of a scan may look
/// like one. `from` is where the last frame ended.
fn lies_in_lms2xx(bytes: &[u8], from: usize, frame: &Frame<'_>) -> bool {
    let start = frame.offset as usize;
    let covers = |at: usize| {
        let found = bytes.get(at..).and_then(|bytes| lms2xx::frame(bytes, Options::default()));
        found.is_some_and(|(len, _)| at + len > start)
    };
    frame.dialect == Dialect::A
        && Telegram::parse(frame.dialect, frame.payload).is_err()
        && (from..=start).any(covers)
}

/// How much is shown.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Long lists of values are written out in words.
    pub values: bool,
    /// Every field and value as JSON.
    pub fields: bool,
}

/// More is recorded than can be put in order at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "it holds more than is decoded at once: 256 MB and {MOST_LINES} lines, and 64 MB where every field is written out; take a part of it, such as \
     `head -c 64M FILE | rowscan decode -`, of a capture `editcap -c 100000 FILE PART`"
)]
pub struct TooLong;

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Transcript {
    /// In the order the bytes came.
    pub lines: Vec<Entry>,
    /// TCP connections of a capture that carry no telegram at all, which are left out.
    pub other_connections: usize,
}

impl Transcript {
    /// All lines of an input.
    ///
    /// # Errors
    /// There are more than [`MOST_LINES`].
    pub fn of(input: &Input, options: Options) -> Result<Self, TooLong> {
        let mut transcript = Self::default();
        for streams in input.connections() {
            let lines: Vec<Entry> = streams.iter().flat_map(|stream| stream.lines(options)).collect();
            if input.is_capture() && !lines.iter().any(|line| line.dialect.is_some()) {
                transcript.other_connections += 1;
                continue;
            }
            transcript.lines.extend(lines);
            if transcript.lines.len() > MOST_LINES {
                return Err(TooLong);
            }
        }
        transcript.lines.extend_from_slice(input.others());
        // Stable: without times the file's order stays.
        transcript.lines.sort_by(|a, b| {
            let time = |line: &Entry| line.time_s.unwrap_or_default();
            time(a).total_cmp(&time(b))
        });
        transcript.lines.extend(input.torn());
        Ok(transcript)
    }

    /// How many lines are of a kind.
    pub fn count(&self, is: Verdict) -> usize {
        self.lines.iter().filter(|line| line.is == is).count()
    }

    /// Frames of any protocol that is known here. Noise may be framed as CoLa A is: only what holds a command counts.
    pub fn frames(&self) -> usize {
        let is_noise = |line: &Entry| line.is == Verdict::Bad && line.kind.is_none();
        self.lines.iter().filter(|line| line.dialect.is_some() && !is_noise(line)).count()
    }
}
