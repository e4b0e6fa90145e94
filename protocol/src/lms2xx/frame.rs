//! Frames of the LMS2xx: `02`, address, length, body, CRC; and two bytes that stand alone.
//!
//! | bytes | are |
//! |---|---|
//! | `02` | start |
//! | 1 | address: of the device, 0; with 80 added from the device |
//! | 2 | length of the body, low byte first |
//! | 1… | body: command, data, and from the device a status byte |
//! | 2 | [`checksum`] of all before it, low byte first |
//!
//! `06` alone acknowledges a command, `15` alone reports a broken frame.
//!
//! A request ends what the device is sending ([`cut_off`]): behind a few bytes of a telegram comes the `06`, and the reply. Whoever reads as many bytes
//! as the head says takes them for the rest of it.

use alloc::vec::Vec;

use byteorder::{ByteOrder, LittleEndian};

use super::words::{put_words, word};
pub use crate::frame::FrameCounts;
use crate::frame::STX;

/// A command was received.
pub const ACK: u8 = 0x06;
/// A broken frame was received.
pub const NAK: u8 = 0x15;
/// Added to the address in what a device sends.
pub const FROM_DEVICE: u8 = 0x80;
/// Largest body, bytes: 401 values with their reflectivities in five parts, `F5`, with indices.
pub const MAX_BODY: usize = 1 + 2 + 5 * 6 + 401 * 4 + 2 + 1;
/// The longest scan without reflectivities, bytes with its frame: 401 values and indices.
pub const LONGEST_SCAN: usize = 814;
/// Start, address and length.
const HEADER: usize = 4;
/// Header and CRC.
pub const OVERHEAD: usize = HEADER + 2;

/// SICK's CRC: polynomial 8005, and two data bytes go into every step.
///
/// ```
/// use rowscan_protocol::lms2xx::frame::checksum;
/// assert_eq!(checksum(&[0x02, 0x00, 0x01, 0x00, 0x31]).to_le_bytes(), [0x15, 0x12]);
/// ```
pub fn checksum(bytes: &[u8]) -> u16 {
    let mut previous = 0;
    bytes.iter().fold(0, |crc: u16, &byte| {
        let shifted = crc << 1;
        let reduced = if crc & 0x8000 == 0 { shifted } else { shifted ^ 0x8005 };
        reduced ^ u16::from_be_bytes([core::mem::replace(&mut previous, byte), byte])
    })
}

/// Appends one frame around the body that `write` appends.
pub fn encode_with(address: u8, out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.extend_from_slice(&[STX, address, 0, 0]);
    write(out);
    let body = out.len() - start - HEADER;
    // A body that does not fit the length field would be refused with the checksum; telegrams never are that long.
    LittleEndian::write_u16(&mut out[start + 2..], u16::try_from(body).unwrap_or(u16::MAX));
    let crc = checksum(out.get(start..).unwrap_or_default());
    put_words(&[crc], out);
}

/// Appends `body` as one frame.
pub fn encode(address: u8, body: &[u8], out: &mut Vec<u8>) {
    encode_with(address, out, |out| out.extend_from_slice(body));
}

/// The length of the good frame that `bytes` begin with.
pub fn whole(bytes: &[u8]) -> Option<usize> {
    let [STX, _, low, high, ..] = *bytes else { return None };
    let body = usize::from(word([low, high]));
    let (summed, crc) = bytes.get(..body + OVERHEAD)?.split_last_chunk::<2>()?;
    ((1..=MAX_BODY).contains(&body) && word(*crc) == checksum(summed)).then_some(body + OVERHEAD)
}

/// How many bytes of the telegram that `bytes` begin with a device has sent, where a request has cut it off; none where it is damaged, or not whole
/// yet. What comes next is whole: an acknowledgement with a telegram behind it, or in a log of both sides the request.
///
/// ```
/// use rowscan_protocol::lms2xx::frame::{ACK, FROM_DEVICE, cut_off, encode};
/// let mut bytes = b"\x02\x80\xD6\x02\xB0\x69\x41".to_vec(); // 7 bytes of a scan of 732
/// bytes.push(ACK);
/// encode(FROM_DEVICE, &[0xA0, 0, 0x10], &mut bytes);
/// assert_eq!(cut_off(&bytes), Some(7));
/// ```
pub fn cut_off(bytes: &[u8]) -> Option<usize> {
    match Cut::of(bytes, Listener::Either, true) {
        Cut::At(sent) => Some(sent),
        Cut::No | Cut::Perhaps => None,
    }
}

/// Whether a request has cut off the device's telegram that some bytes begin with.
enum Cut {
    /// Behind so many bytes.
    At(usize),
    No,
    /// What would show it is not whole yet.
    Perhaps,
}

impl Cut {
    fn of(bytes: &[u8], listener: Listener, ended: bool) -> Self {
        let [STX, address, low, high, ..] = *bytes else { return Self::No };
        let body = usize::from(word([low, high]));
        if address & FROM_DEVICE == 0 || !(1..=MAX_BODY).contains(&body) || listener == Listener::Device {
            return Self::No;
        }
        // Of the head two bytes are known to have come.
        for at in 3..bytes.len().min(body + OVERHEAD) {
            let next = bytes.get(at..).unwrap_or_default();
            let acknowledged = bytes.get(at - 1).is_some_and(|byte| matches!(*byte, ACK | NAK));
            let asked = listener == Listener::Either && next.get(1).is_some_and(|to| to & FROM_DEVICE == 0);
            match next {
                [STX, ..] if whole(next).is_some() => {
                    return match (asked, acknowledged) {
                        (true, _) => Self::At(at),
                        (false, true) => Self::At(at - 1),
                        (false, false) => Self::No,
                    };
                }
                [STX, ..] if !ended && (asked || acknowledged) && may_become_whole(next) => {
                    return Self::Perhaps;
                }
                _ => {}
            }
        }
        Self::No
    }
}

/// Whether the rest of a frame may still come.
fn may_become_whole(bytes: &[u8]) -> bool {
    let Some(&[low, high]) = bytes.get(2..HEADER) else { return true };
    let body = usize::from(word([low, high]));
    (1..=MAX_BODY).contains(&body) && bytes.len() < body + OVERHEAD
}

/// Whose frames are decoded: the two sides' frames differ in their address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Listener {
    /// The device receives frames to its address.
    Device,
    /// The host receives frames from any device.
    Host,
    /// A tapped line, or a recording of one: both sides' frames.
    Either,
}

/// What the decoder finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received<'a> {
    /// A good frame.
    Frame(Frame<'a>),
    /// A whole frame with a wrong checksum.
    Broken,
    /// The beginning of a device's frame, the rest of which a request has cut off.
    CutOff {
        /// Place of its first byte in the stream.
        offset: u64,
        /// Bytes that were sent of it.
        len: usize,
    },
    /// `06` between frames.
    Ack,
    /// `15` between frames.
    Nak,
}

/// One good frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Address, as sent.
    pub address: u8,
    /// Command, data and status byte; never empty.
    pub body: &'a [u8],
    /// Place of its first byte in the stream.
    pub offset: u64,
    /// Bytes it takes in the stream.
    pub len: usize,
}

impl Frame<'_> {
    /// True if a device sent it.
    pub fn is_from_device(&self) -> bool {
        self.address & FROM_DEVICE != 0
    }
}

/// Finds frames in a byte stream that comes in pieces.
///
/// After a rejected start the search goes on one byte further, so that a good frame inside the bytes a broken one claimed is found. A
/// start claims at most 1646 bytes, and so does what may follow one that was cut off, which bounds what hostile input costs, and what is kept of it.
#[derive(Clone, Debug)]
pub struct FrameDecoder {
    listener: Listener,
    buffer: Vec<u8>,
    /// Everything before this index of `buffer` is done with.
    start: usize,
    /// Place in the stream of `buffer[0]`.
    base: u64,
    /// Bytes below this index were claimed by a frame that turned out broken; false starts among them do not count again.
    suspect_until: usize,
    ended: bool,
    counts: FrameCounts,
}

/// What the bytes from an STX on are.
enum Probe {
    Frame(usize),
    Broken(usize),
    NotAFrame,
    Incomplete,
}

impl FrameDecoder {
    /// A decoder for `listener`.
    pub fn new(listener: Listener) -> Self {
        Self {
            listener,
            buffer: Vec::new(),
            start: 0,
            base: 0,
            suspect_until: 0,
            ended: false,
            counts: FrameCounts::default(),
        }
    }

    /// Takes the next bytes of the stream. Call [`next_received`](Self::next_received) until it gives `None` before the next push.
    pub fn push(&mut self, bytes: &[u8]) {
        if self.start * 2 >= self.buffer.len() {
            self.buffer.drain(..self.start);
            self.base += self.start as u64;
            self.suspect_until = self.suspect_until.saturating_sub(self.start);
            self.start = 0;
        }
        self.buffer.extend_from_slice(bytes);
        self.ended = false;
    }

    /// An unfinished frame will not be finished: the line was silent for too long, or the stream has ended. Good frames inside it come
    /// out.
    pub fn finish(&mut self) {
        self.ended = true;
    }

    /// True if a good frame has come behind the beginning of another that is not whole: no more will come of that one.
    pub fn holds_frame(&self) -> bool {
        let pending = self.buffer.get(self.start..).unwrap_or_default();
        (1..pending.len()).any(|at| {
            let rest = pending.get(at..).unwrap_or_default();
            rest.get(1).is_some_and(|address| self.hears(*address)) && whole(rest).is_some()
        })
    }

    /// What was seen so far.
    pub fn counts(&self) -> FrameCounts {
        self.counts
    }

    /// Bytes kept while waiting for the rest of a frame.
    pub fn pending(&self) -> usize {
        self.buffer.len() - self.start
    }

    /// Of these, bytes of a frame whose rest may still come: what only looks like the start of one, within a frame that is whole and broken, is none.
    pub fn unfinished(&self) -> usize {
        if self.start < self.suspect_until { 0 } else { self.pending() }
    }

    /// Skips what cannot begin anything, and counts all that was skipped so far.
    pub(super) fn skip_junk(&mut self) -> u64 {
        while self.buffer.get(self.start).is_some_and(|byte| !matches!(*byte, STX | ACK | NAK)) {
            self.skip();
        }
        self.counts.skipped_bytes
    }

    /// The next frame or single byte. Junk before it is counted and skipped.
    pub fn next_received(&mut self) -> Option<Received<'_>> {
        loop {
            let from = self.start;
            match *self.buffer.get(from)? {
                STX => {}
                byte @ (ACK | NAK) if self.listener != Listener::Device => {
                    self.start += 1;
                    // Inside a broken frame it is just a byte.
                    if from < self.suspect_until {
                        self.counts.skipped_bytes += 1;
                        continue;
                    }
                    return Some(if byte == ACK { Received::Ack } else { Received::Nak });
                }
                _ => {
                    self.skip();
                    continue;
                }
            }
            match self.probe() {
                Probe::Frame(len) => {
                    self.start += len;
                    self.suspect_until = 0;
                    self.counts.frames += 1;
                    let frame = self.buffer.get(from..from + len)?;
                    return Some(Received::Frame(Frame {
                        address: *frame.get(1)?,
                        body: frame.get(HEADER..len - 2)?,
                        offset: self.base + from as u64,
                        len,
                    }));
                }
                Probe::Broken(extent) => match self.cut() {
                    Cut::At(len) => return Some(self.skip_cut_off(len)),
                    Cut::Perhaps => return None,
                    Cut::No if self.reject(extent) => return Some(Received::Broken),
                    Cut::No => {}
                },
                Probe::NotAFrame => self.skip(),
                Probe::Incomplete if self.ended => match self.cut() {
                    Cut::At(len) => return Some(self.skip_cut_off(len)),
                    Cut::No | Cut::Perhaps => {
                        self.reject(self.buffer.len() - from);
                    }
                },
                Probe::Incomplete => return None,
            }
        }
    }

    fn hears(&self, address: u8) -> bool {
        match self.listener {
            Listener::Device => address == 0,
            Listener::Host => address & FROM_DEVICE != 0,
            Listener::Either => true,
        }
    }

    fn probe(&self) -> Probe {
        let bytes = self.buffer.get(self.start..).unwrap_or_default();
        let Some(&address) = bytes.get(1) else { return Probe::Incomplete };
        if !self.hears(address) {
            return Probe::NotAFrame;
        }
        let Some(&[low, high]) = bytes.get(2..HEADER) else { return Probe::Incomplete };
        let body = usize::from(word([low, high]));
        if !(1..=MAX_BODY).contains(&body) {
            return Probe::NotAFrame;
        }
        let Some((summed, crc)) = bytes.get(..body + OVERHEAD).and_then(<[u8]>::split_last_chunk::<2>) else {
            return Probe::Incomplete;
        };
        if word(*crc) == checksum(summed) {
            Probe::Frame(body + OVERHEAD)
        } else {
            Probe::Broken(body + OVERHEAD)
        }
    }

    /// Whether a request has cut off the telegram that begins here.
    fn cut(&self) -> Cut {
        Cut::of(self.buffer.get(self.start..).unwrap_or_default(), self.listener, self.ended)
    }

    fn skip_cut_off(&mut self, len: usize) -> Received<'static> {
        let offset = self.base + self.start as u64;
        self.start += len;
        self.suspect_until = 0;
        self.counts.skipped_bytes += len as u64;
        Received::CutOff { offset, len }
    }

    fn skip(&mut self) {
        self.start += 1;
        self.counts.skipped_bytes += 1;
    }

    /// True if these bytes were not part of a broken frame already.
    fn reject(&mut self, extent: usize) -> bool {
        let new = self.start >= self.suspect_until;
        // A false start within a broken frame claims nothing of what stands behind that.
        if new {
            self.counts.bad += 1;
            self.suspect_until = self.start + extent;
        }
        self.skip();
        new
    }
}
