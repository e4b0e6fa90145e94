//! The incremental frame decoder: one resynchronisation loop for both dialects.
//!
//! After a rejected start the search goes on one byte further, so a good frame hidden in the bytes a broken one claimed
//! is still found. That must not make hostile input expensive: every byte is
//! - searched for STX once,
//! - searched for ETX once (an unfinished text frame remembers how far it was read),
//! - summed at most twice: once directly, and once into a table of running sums that answers every further
//!   candidate inside a rejected frame in constant time.
//!
//! So the cost is linear in the input, whatever it holds. Memory is bounded by twice the largest
//! payload plus one push.

use alloc::vec::Vec;
use core::ops::Range;

use super::{Dialect, Probe, STX, checksum, cola_a, cola_b};

/// Which dialects a decoder takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accept {
    /// Both, decided frame by frame from the bytes after STX.
    Either,
    /// One; frames of the other are junk.
    Only(Dialect),
}

impl Accept {
    fn takes(self, dialect: Dialect) -> bool {
        match self {
            Self::Either => true,
            Self::Only(only) => only == dialect,
        }
    }
}

/// Bytes before the payload of a binary frame.
const HEADER: usize = 8;

/// What may stand between frames and is no damage.
const PADDING: [u8; 3] = [0, b'\r', b'\n'];

/// What a decoder has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    /// Good frames.
    pub frames: u64,
    /// Broken frames: wrong checksum, impossible length, text without end. False starts inside a broken frame's bytes do not
    /// count again.
    pub bad: u64,
    /// Bytes that are part of no good frame.
    pub skipped_bytes: u64,
    /// Stretches of such bytes behind the first good frame in which no broken frame begins: what has lost its start, or was never one.
    pub junk_stretches: u64,
}

impl FrameCounts {
    /// Stretches of a stream that were no good frames, between good ones: broken frames, and what does not even begin as one.
    pub fn damaged(&self) -> u64 {
        self.bad + self.junk_stretches
    }
}

/// One good frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// How it was framed.
    pub dialect: Dialect,
    /// What it holds, without framing.
    pub payload: &'a [u8],
    /// Place of its first byte in the stream.
    pub offset: u64,
    /// Bytes it takes in the stream, framing included.
    pub len: usize,
}

/// Finds frames in a byte stream that comes in pieces.
///
/// ```
/// use rowscan_protocol::frame::{Accept, FrameDecoder};
/// let mut decoder = FrameDecoder::new(Accept::Either, 1024);
/// decoder.push(b"junk\x02sRN Device");
/// assert!(decoder.next_frame().is_none());
/// decoder.push(b"Ident\x03\0");
/// assert_eq!(decoder.next_frame().unwrap().payload, b"sRN DeviceIdent");
/// assert_eq!(decoder.counts().skipped_bytes, 4);
/// ```
#[derive(Clone, Debug)]
pub struct FrameDecoder {
    accept: Accept,
    max_payload: usize,
    buffer: Vec<u8>,
    /// Everything before this index of `buffer` is done with.
    start: usize,
    /// Place in the stream of `buffer[0]`.
    base: u64,
    /// Bytes from `start` on that an unfinished text frame has already been searched for its end.
    examined: usize,
    /// Bytes below this index were claimed by a frame that turned out broken.
    suspect_until: usize,
    /// The end of the broken frame that was counted last.
    broken_until: usize,
    /// That one was whole: what begins at its end is another.
    broken_is_whole: bool,
    /// Running XOR of `buffer`: `sums[i] ^ sums[j]` is the XOR of the bytes `sums_from + i..sums_from + j`. Only kept inside
    /// suspect bytes.
    sums: Vec<u8>,
    sums_from: usize,
    ended: bool,
    /// No good frame has come since bytes were skipped that have been counted.
    in_junk: bool,
    counts: FrameCounts,
}

impl FrameDecoder {
    /// A decoder for frames with payloads of up to `max_payload` bytes.
    pub fn new(accept: Accept, max_payload: usize) -> Self {
        Self {
            accept,
            max_payload,
            buffer: Vec::new(),
            start: 0,
            base: 0,
            examined: 0,
            suspect_until: 0,
            broken_until: 0,
            broken_is_whole: false,
            sums: Vec::new(),
            sums_from: 0,
            ended: false,
            in_junk: false,
            counts: FrameCounts::default(),
        }
    }

    /// Takes the next bytes of the stream. Call [`next_frame`](Self::next_frame) until it gives `None` before the next push:
    /// then no more than one unfinished frame is kept.
    pub fn push(&mut self, bytes: &[u8]) {
        // Moving what is left only when it is the smaller half keeps the cost of many small pushes linear.
        if self.start * 2 >= self.buffer.len() {
            self.compact();
        }
        self.buffer.extend_from_slice(bytes);
        self.ended = false;
    }

    /// No more bytes will come: what is still waiting for its end is broken, and good frames inside it come out.
    pub fn finish(&mut self) {
        self.ended = true;
    }

    /// The next good frame. Junk and broken frames before it are counted and skipped.
    pub fn next_frame(&mut self) -> Option<Frame<'_>> {
        let (dialect, start, payload, len) = self.find()?;
        let offset = self.base + start as u64;
        Some(Frame { dialect, payload: self.buffer.get(payload)?, offset, len })
    }

    /// What was seen so far.
    pub fn counts(&self) -> FrameCounts {
        self.counts
    }

    /// From now on takes frames of `dialect` only.
    pub fn accept_only(&mut self, dialect: Dialect) {
        self.accept(Accept::Only(dialect));
    }

    /// From now on takes frames as `accept` says.
    pub fn accept(&mut self, accept: Accept) {
        self.accept = accept;
        self.examined = 0;
    }

    /// Bytes kept while waiting for the rest of a frame.
    pub fn pending(&self) -> usize {
        self.buffer.len() - self.start
    }

    /// Of these, bytes of a frame whose rest may still come: what only looks like the start of one, within a frame that is whole and broken, is none.
    pub fn unfinished(&self) -> usize {
        if self.start < self.broken_until { 0 } else { self.pending() }
    }

    fn find(&mut self) -> Option<(Dialect, usize, Range<usize>, usize)> {
        loop {
            self.skip_to_stx();
            if self.start == self.buffer.len() {
                return None;
            }
            let (dialect, probe) = self.probe();
            match probe {
                Probe::Frame { header, payload, trailer } => {
                    let start = self.start;
                    let len = header + payload + trailer;
                    self.start += len;
                    self.examined = 0;
                    (self.suspect_until, self.broken_until) = (0, 0);
                    self.in_junk = false;
                    self.drop_sums();
                    self.counts.frames += 1;
                    return Some((dialect, start, start + header..start + header + payload, len));
                }
                Probe::Incomplete { examined } if !self.ended => {
                    self.examined = examined;
                    return None;
                }
                Probe::Incomplete { .. } => self.reject(self.buffer.len() - self.start),
                Probe::Broken { extent } => self.reject(extent),
                Probe::NotAFrame => self.skip_junk(1),
            }
        }
    }

    fn probe(&mut self) -> (Dialect, Probe) {
        let Self { buffer, start, suspect_until, sums, sums_from, max_payload, examined, accept, .. } = self;
        let bytes = buffer.get(*start..).unwrap_or_default();
        // The byte after the first STX tells the dialects apart.
        let dialect = if bytes.get(1) == Some(&STX) { Dialect::B } else { Dialect::A };
        if bytes.len() > 1 && !accept.takes(dialect) {
            return (dialect, Probe::NotAFrame);
        }
        let probe = match dialect {
            Dialect::A => cola_a::probe(bytes, *examined, *max_payload),
            Dialect::B => cola_b::probe(bytes, *max_payload, |range| {
                if *start >= *suspect_until {
                    return checksum(bytes.get(range).unwrap_or_default());
                }
                running_xor(buffer, sums, sums_from, *start + range.start..*start + range.end)
            }),
        };
        (dialect, probe)
    }

    fn skip_to_stx(&mut self) {
        let rest = self.buffer.get(self.start..).unwrap_or_default();
        let junk = rest.iter().position(|&b| b == STX).unwrap_or(rest.len());
        // Some devices fill up with NUL, or end lines, behind a frame.
        let is_padding = rest.iter().take(junk).all(|byte| PADDING.contains(byte));
        match junk {
            0 => {}
            _ if is_padding => self.skip(junk),
            _ => self.skip_junk(junk),
        }
    }

    /// Skips bytes that begin no frame.
    fn skip_junk(&mut self, bytes: usize) {
        let is_new = !self.in_junk && self.start >= self.broken_until && self.counts.frames > 0;
        self.counts.junk_stretches += u64::from(is_new);
        self.in_junk |= is_new;
        self.skip(bytes);
    }

    fn skip(&mut self, bytes: usize) {
        self.start += bytes;
        self.examined = 0;
        self.counts.skipped_bytes += bytes as u64;
    }

    fn reject(&mut self, extent: usize) {
        if self.start >= self.broken_until {
            self.counts.bad += 1;
            // What is left of it behind its claim is not damaged once more.
            self.in_junk = true;
            self.broken_until = self.start + extent;
            self.broken_is_whole = extent > HEADER;
        } else if !self.broken_is_whole {
            // A run of starts is one. A false start within a whole frame claims nothing of what stands behind that.
            self.broken_until = self.broken_until.max(self.start + extent.min(HEADER));
        }
        if self.start >= self.suspect_until {
            self.drop_sums();
        }
        self.suspect_until = self.suspect_until.max(self.start + extent);
        self.skip(1);
    }

    fn drop_sums(&mut self) {
        self.sums.clear();
    }

    fn compact(&mut self) {
        let done = core::mem::take(&mut self.start);
        self.buffer.drain(..done);
        self.base += done as u64;
        self.suspect_until = self.suspect_until.saturating_sub(done);
        self.broken_until = self.broken_until.saturating_sub(done);
        let stale = done.saturating_sub(self.sums_from).min(self.sums.len());
        self.sums.drain(..stale);
        self.sums_from = self.sums_from.saturating_sub(done);
    }
}

/// XOR of `range` of `buffer` from the table of running sums, which is extended as far as needed.
fn running_xor(buffer: &[u8], sums: &mut Vec<u8>, sums_from: &mut usize, range: Range<usize>) -> u8 {
    if sums.is_empty() {
        sums.push(0);
        *sums_from = range.start;
    }
    let summed_until = *sums_from + sums.len() - 1;
    let mut sum = sums.last().copied().unwrap_or_default();
    for byte in buffer.get(summed_until..range.end).unwrap_or_default() {
        sum ^= byte;
        sums.push(sum);
    }
    let until = |end: usize| sums.get(end - *sums_from).copied().unwrap_or_default();
    until(range.start) ^ until(range.end)
}
