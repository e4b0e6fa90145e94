//! Recorded frames in the time that they are played in: the file's, or where a stream's clock stands still, that of its scans' own rate.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use rowscan_protocol::counting::{Counting, Turn, nominal_period_s};
use rowscan_protocol::host::HostEvent;
use rowscan_protocol::lms2xx::{Variant, model};
use rowscan_protocol::scan::Scan;
use rowscan_recording::{
    FrameReader, MAX_PAYLOAD, ReadError, RecordedFrame, Recording, ScanReader, Side, StreamKind,
};

/// A recording, frame by frame.
#[derive(Debug)]
pub(super) struct TimedFrames {
    frames: FrameReader,
    /// Streams whose clock stands still.
    still: BTreeMap<usize, ScanTime>,
}

impl TimedFrames {
    /// Opens a file; of a capture, the connections of these names are streams of their own. The clock of the streams `still` tells nothing.
    pub(super) fn open(path: &Path, names: &[&str], still: &[usize]) -> Result<Self, ReadError> {
        let frames = FrameReader::new(Recording::open_apart(path, names)?);
        Ok(Self { frames, still: still.iter().map(|stream| (*stream, ScanTime::default())).collect() })
    }

    /// The recording itself.
    pub(super) fn recording(&self) -> &Recording {
        self.frames.recording()
    }

    /// The next frame; none at the end.
    pub(super) fn next_frame(&mut self) -> Result<Option<RecordedFrame>, ReadError> {
        let Some(mut frame) = self.frames.next_frame()? else { return Ok(None) };
        if let Some(time) = self.still.get_mut(&frame.stream) {
            frame.at_ns = frame.at_ns.saturating_add(time.at(&frame));
        }
        Ok(Some(frame))
    }

    /// Scans a second of a stream whose clock stands still, once one was read.
    pub(super) fn hertz(&self, stream: usize) -> Option<f64> {
        self.still.get(&stream)?.hertz
    }
}

/// Counts a stream's scans for want of a clock, as an estimate does.
#[derive(Debug, Default)]
struct ScanTime {
    reader: Option<ScanReader>,
    counting: Counting,
    hertz: Option<f64>,
    passed_s: f64,
}

impl ScanTime {
    /// When the frame's scan was made, ns since the first; of another frame, when the last one before it was.
    fn at(&mut self, frame: &RecordedFrame) -> u64 {
        if frame.from == Side::Device {
            let reader = self.reader.take().or_else(|| ScanReader::new(frame.kind, MAX_PAYLOAD));
            if let Some(mut reader) = reader {
                reader.push_bytes(Duration::ZERO, &frame.bytes);
                while let Some(event) = reader.next_event() {
                    if event == HostEvent::Scan {
                        self.count(frame.kind, reader.scan());
                    }
                }
                self.reader = Some(reader);
            }
        }
        (self.passed_s * 1e9).round() as u64
    }

    fn count(&mut self, kind: StreamKind, scan: &Scan) {
        if kind == StreamKind::Lms2xx {
            self.counting.assume_hz(mirror_hz(scan));
        }
        let period_s = nominal_period_s(self.counting.nominal_hz(scan));
        self.hertz = Some(period_s.recip());
        match self.counting.observe(scan) {
            Turn::Line { travel_s, .. } => self.passed_s = self.passed_s.max(travel_s),
            // Neither clock nor counter goes on: the next scan all the same.
            Turn::Repeated | Turn::Late => self.passed_s += period_s,
        }
    }
}

/// Scans a second that an LMS2xx makes of such beams.
fn mirror_hz(scan: &Scan) -> f64 {
    let (step, intervals) = (u32::from(scan.beams.step), u32::from(scan.beams.count.saturating_sub(1)));
    let degrees = |ten_thousandths: u32| u16::try_from(ten_thousandths / 10_000).unwrap_or(u16::MAX);
    let variant = Variant { angle_deg: degrees(step * intervals), step_centideg: scan.beams.step / 100 };
    model::scans_per_second(variant)
}
