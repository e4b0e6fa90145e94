//! A recording as telegrams: whole frames with their sender and their time, whatever file they come from.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::telegram::Telegram;
use rowscan_protocol::time::DeviceClock;

use crate::finder::Finder;
use crate::scan_reader::{MAX_PAYLOAD, ScanReader};
use crate::{Joint, Packet, ReadError, Recording, Side, StreamKind};

/// One frame, or one packet of a stream that knows no frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordedFrame {
    /// Which stream of the recording.
    pub stream: usize,
    /// What the stream's bytes are.
    pub kind: StreamKind,
    /// Who sent it.
    pub from: Side,
    /// When its last byte came, ns. In a log without times the device's clock stands in, from the first scan on.
    pub at_ns: u64,
    /// The bytes on the wire; in a CoLa stream, junk before the frame stays with it.
    pub bytes: Vec<u8>,
    /// Where in `bytes` the frame begins.
    pub frame_at: usize,
    /// CoLa's dialect; none for other streams.
    pub dialect: Option<Dialect>,
}

impl RecordedFrame {
    /// What the frame holds, without framing.
    pub fn payload(&self) -> &[u8] {
        let (header, trailer) = match (self.dialect, self.kind) {
            (Some(Dialect::A), _) => (1, 1),
            (Some(Dialect::B), _) => (8, 1),
            (None, StreamKind::Lms2xx) => (4, 2),
            (None, _) => (0, 0),
        };
        let end = self.bytes.len().saturating_sub(trailer);
        self.bytes.get(self.frame_at + header..end).unwrap_or_default()
    }

    /// The telegram in it; none if it is none.
    pub fn telegram(&self) -> Option<Telegram<'_>> {
        Telegram::parse(self.dialect?, self.payload()).ok()
    }
}

/// Reads a recording frame by frame.
#[derive(Debug)]
pub struct FrameReader {
    recording: Recording,
    flows: BTreeMap<(usize, Option<Side>), Flow>,
    clock: DeviceClock,
    /// Counts mirror turns where an LMS2xx's log has no times.
    turns: Option<ScanReader>,
    /// The time the device's clock stands for, where the log has none.
    device_ns: u64,
    ready: VecDeque<RecordedFrame>,
    keeps_unfinished: bool,
}

/// One direction.
#[derive(Debug)]
struct Flow {
    kind: StreamKind,
    finder: Finder,
    /// Bytes since the last frame.
    pending: Vec<u8>,
    /// Place in the decoder's stream of `pending[0]`; below 0 of bytes that another decoder has had.
    base: i64,
    /// When the last bytes came.
    at_ns: Option<u64>,
}

impl FrameReader {
    /// Reads `recording` from where it is.
    pub fn new(recording: Recording) -> Self {
        Self {
            recording,
            flows: BTreeMap::new(),
            clock: DeviceClock::default(),
            turns: None,
            device_ns: 0,
            ready: VecDeque::new(),
            keeps_unfinished: false,
        }
    }

    /// The same, for a copy: what a telegram that was never finished had of bytes stays with the next frame, as junk before a frame does.
    pub(crate) fn keeping_unfinished(self) -> Self {
        Self { keeps_unfinished: true, ..self }
    }

    /// The recording itself.
    pub fn recording(&self) -> &Recording {
        &self.recording
    }

    /// The next frame; none at the end.
    pub fn next_frame(&mut self) -> Result<Option<RecordedFrame>, ReadError> {
        loop {
            if let Some(frame) = self.ready.pop_front() {
                return Ok(Some(frame));
            }
            let Some(packet) = self.recording.next_packet()? else {
                let keeps = self.keeps_unfinished && self.recording.torn().is_none();
                for (way, mut flow) in std::mem::take(&mut self.flows) {
                    self.end(&mut flow, way);
                    if keeps && !flow.pending.is_empty() {
                        self.ready.push_back(self.left_of(flow, way));
                    }
                }
                return Ok(self.ready.pop_front());
            };
            let kind =
                self.recording.streams().get(packet.stream).map_or(StreamKind::Bytes, |stream| stream.kind);
            match kind {
                StreamKind::Cola | StreamKind::Lms2xx | StreamKind::Compact => self.take(kind, packet),
                kind => {
                    return Ok(Some(RecordedFrame {
                        stream: packet.stream,
                        kind,
                        from: packet.from.unwrap_or(Side::Device),
                        at_ns: packet.at_ns.unwrap_or_default(),
                        bytes: packet.bytes,
                        frame_at: 0,
                        dialect: None,
                    }));
                }
            }
        }
    }

    fn take(&mut self, kind: StreamKind, packet: Packet) {
        let way = (packet.stream, packet.from);
        let mut flow = self.flows.remove(&way).unwrap_or_else(|| Flow::new(kind, packet.from));
        if packet.joint != Joint::Seamless && !flow.pending.is_empty() {
            // What was unfinished stays so: a new beginning.
            self.end(&mut flow, way);
            let left = if self.keeps_unfinished { flow.pending } else { Vec::new() };
            flow = Flow { base: -(left.len() as i64), pending: left, ..Flow::new(kind, packet.from) };
        }
        flow.at_ns = packet.at_ns;
        flow.finder.push(&packet.bytes);
        flow.pending.extend_from_slice(&packet.bytes);
        self.drain(&mut flow, way);
        // Bytes that are no telegram must not pile up.
        if flow.pending.len() > 2 * MAX_PAYLOAD {
            let done = flow.pending.len() - flow.finder.pending();
            flow.base += done as i64;
            flow.pending.drain(..done);
        }
        self.flows.insert(way, flow);
    }

    /// No more bytes come this way: frames behind one that claims more than there was are frames all the same.
    fn end(&mut self, flow: &mut Flow, way: (usize, Option<Side>)) {
        flow.finder.finish();
        self.drain(flow, way);
    }

    /// Bytes behind the last frame of all.
    fn left_of(&self, flow: Flow, (stream, from): (usize, Option<Side>)) -> RecordedFrame {
        RecordedFrame {
            stream,
            kind: flow.kind,
            from: from.unwrap_or(Side::Device),
            at_ns: flow.at_ns.unwrap_or(self.device_ns),
            bytes: flow.pending,
            frame_at: 0,
            dialect: None,
        }
    }

    /// Takes the frames that are whole.
    fn drain(&mut self, flow: &mut Flow, (stream, from): (usize, Option<Side>)) {
        while let Some(found) = flow.finder.next() {
            let frame_at = (found.offset as i64 - flow.base) as usize;
            let end = frame_at + found.len;
            let rest = flow.pending.split_off(end.min(flow.pending.len()));
            let bytes = std::mem::replace(&mut flow.pending, rest);
            flow.base += end as i64;
            if flow.at_ns.is_none() {
                let device_us = match flow.kind {
                    StreamKind::Lms2xx => {
                        counted_us(self.turns.get_or_insert_with(ScanReader::lms2xx), &bytes)
                    }
                    _ => found.device_us,
                };
                if let Some(us) = device_us {
                    self.device_ns = (self.clock.seconds(us) * 1e9).round() as u64;
                }
            }
            self.ready.push_back(RecordedFrame {
                stream,
                kind: flow.kind,
                from: from.or(found.from).unwrap_or(Side::Device),
                at_ns: flow.at_ns.unwrap_or(self.device_ns),
                bytes,
                frame_at,
                dialect: found.dialect,
            });
        }
    }
}

impl Flow {
    fn new(kind: StreamKind, from: Option<Side>) -> Self {
        Self { kind, finder: Finder::new(kind, from), pending: Vec::new(), base: 0, at_ns: None }
    }
}

/// When the scan in a frame of an LMS2xx was made, by the mirror turns counted so far.
fn counted_us(turns: &mut ScanReader, frame: &[u8]) -> Option<u32> {
    turns.push_bytes(Duration::ZERO, frame);
    turns.next_scan().map(|scan| scan.scan_time_us)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::lms2xx::frame::{FROM_DEVICE, encode_with};
    use rowscan_protocol::lms2xx::values::{CountWord, Output, Unit, Values};

    #[test]
    fn an_lms2xx_without_times_is_timed_by_its_mirror_turns() {
        let mut bytes = Vec::new();
        // 361 values at 38 400 bits a second: a telegram every 16 turns of 1/75 s; one is missing.
        for index in [250_u8, 10, 26, 58] {
            let values = Values {
                output: Output::All,
                word: CountWord { count: 361, partial: None, unit: Some(Unit::Mm) },
                values: vec![1000; 361],
                real_time_index: Some(index),
                status: 0x10,
                ..Values::default()
            };
            bytes.push(0x06);
            encode_with(FROM_DEVICE, &mut bytes, |out| values.encode(out));
        }
        let recording = Recording::read(Box::new(std::io::Cursor::new(bytes))).expect("it opens");
        let mut frames = FrameReader::new(recording);
        let mut times = Vec::new();
        while let Some(frame) = frames.next_frame().expect("it reads") {
            assert_eq!((frame.kind, frame.from, frame.frame_at), (StreamKind::Lms2xx, Side::Device, 1));
            assert_eq!(frame.payload().first(), Some(&0xB0));
            times.push((frame.at_ns as f64 * 1e-6).round());
        }
        assert_eq!(times, [0.0, 213.0, 427.0, 853.0]);
    }

    #[test]
    fn frames_behind_one_that_claims_more_than_there_is_are_found() {
        let scan = b"sSN LMDscandata 1 1 16F4C7A 0 0 1 1 4E20 4E20 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0";
        let mut whole = Vec::new();
        rowscan_protocol::frame::encode(Dialect::A, scan, &mut whole);
        // A frame of CoLa B of 60 000 bytes, by its head.
        let damaged = [&[2, 2, 2, 2, 0, 0, 0xEA, 0x60][..], b"sSN LMDscandata "].concat();
        let bytes = [&whole, &damaged, &whole, &whole].map(|piece| &piece[..]).concat();
        let recording = || Recording::read(Box::new(std::io::Cursor::new(bytes.clone()))).expect("it opens");
        let mut frames = FrameReader::new(recording());
        let mut found = 0;
        while frames.next_frame().expect("it reads").is_some() {
            found += 1;
        }
        let counted = crate::account(&mut recording()).expect("it reads").remove(0).scans;
        assert_eq!((found, counted), (3, 3));
    }
}
