//! A recording as telegrams: whole frames with their sender and their time, whatever file they come from.

use std::collections::{BTreeMap, VecDeque};

use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder};
use rowscan_protocol::telegram::{Kind, LmdScandata, Telegram};
use rowscan_protocol::time::DeviceClock;

use crate::scans::MAX_PAYLOAD;
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
    /// How it is framed; none for a stream that knows no frames.
    pub dialect: Option<Dialect>,
}

impl RecordedFrame {
    /// What the frame holds, without framing.
    pub fn payload(&self) -> &[u8] {
        let header = match self.dialect {
            Some(Dialect::A) => 1,
            Some(Dialect::B) => 8,
            None => 0,
        };
        let end = self.bytes.len() - usize::from(self.dialect.is_some());
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
    /// The time the device's clock stands for, where the log has none.
    device_ns: u64,
    ready: VecDeque<RecordedFrame>,
}

/// One direction.
#[derive(Debug)]
struct Flow {
    decoder: FrameDecoder,
    /// Bytes since the last frame.
    pending: Vec<u8>,
    /// Place in the decoder's stream of `pending[0]`.
    base: u64,
}

impl FrameReader {
    /// Reads `recording` from where it is.
    pub fn new(recording: Recording) -> Self {
        Self {
            recording,
            flows: BTreeMap::new(),
            clock: DeviceClock::default(),
            device_ns: 0,
            ready: VecDeque::new(),
        }
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
            let Some(packet) = self.recording.next_packet()? else { return Ok(None) };
            let kind =
                self.recording.streams().get(packet.stream).map_or(StreamKind::Bytes, |stream| stream.kind);
            match kind {
                StreamKind::Cola => self.take(packet),
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

    fn take(&mut self, packet: Packet) {
        let flow = self.flows.entry((packet.stream, packet.from)).or_insert_with(|| Flow {
            decoder: FrameDecoder::new(Accept::Either, MAX_PAYLOAD),
            pending: Vec::new(),
            base: 0,
        });
        if packet.joint != Joint::Seamless && !flow.pending.is_empty() {
            // What was unfinished stays so: a new beginning.
            *flow = Flow {
                decoder: FrameDecoder::new(Accept::Either, MAX_PAYLOAD),
                pending: Vec::new(),
                base: 0,
            };
        }
        flow.decoder.push(&packet.bytes);
        flow.pending.extend_from_slice(&packet.bytes);
        while let Some(frame) = flow.decoder.next_frame() {
            let telegram = Telegram::parse(frame.dialect, frame.payload).ok();
            let from = packet.from.or_else(|| telegram.map(|telegram| Side::of(telegram.kind)));
            if let (None, Some(us)) = (packet.at_ns, telegram.and_then(transmit_time_us)) {
                self.device_ns = (self.clock.seconds(us) * 1e9).round() as u64;
            }
            let frame_at = (frame.offset - flow.base) as usize;
            let end = frame_at + frame.len;
            let rest = flow.pending.split_off(end.min(flow.pending.len()));
            let bytes = std::mem::replace(&mut flow.pending, rest);
            flow.base += end as u64;
            self.ready.push_back(RecordedFrame {
                stream: packet.stream,
                kind: StreamKind::Cola,
                from: from.unwrap_or(Side::Device),
                at_ns: packet.at_ns.unwrap_or(self.device_ns),
                bytes,
                frame_at,
                dialect: Some(frame.dialect),
            });
        }
        // Bytes that are no telegram must not pile up.
        if flow.pending.len() > 2 * MAX_PAYLOAD {
            flow.base += (flow.pending.len() - flow.decoder.pending()) as u64;
            let done = flow.pending.len() - flow.decoder.pending();
            flow.pending.drain(..done);
        }
    }
}

/// When a scan was sent, by the device's clock.
fn transmit_time_us(telegram: Telegram<'_>) -> Option<u32> {
    if telegram.kind != Kind::Sn || !telegram.name.starts_with("LMDscandata") {
        return None;
    }
    telegram.args.decode::<LmdScandata>().ok().map(|scan| scan.transmit_time_us)
}
