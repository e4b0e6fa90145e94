//! The lines of an LMS2xx as others may watch them, read out of what it puts on its own line.

use std::collections::HashMap;
use std::time::Duration;

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::host::HostEvent;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{ScanReader, StreamKind};
use rowscan_scenes::Class;

use crate::line_watch::LineWatch;
use crate::view::ScannerView;

/// Reads along what is sent, while somebody watches.
#[derive(Debug)]
pub(crate) struct SentLines {
    watch: LineWatch,
    reader: ScanReader,
    /// What the beams of a scan's mirror turns have met, by device angle: an interlaced scan's turns lie between one another.
    met: HashMap<i32, Class>,
}

impl SentLines {
    /// For an LMS2xx whose lines are watched there.
    pub(crate) fn new(watch: LineWatch) -> Option<Self> {
        // Payloads of an LMS2xx are bounded by their language.
        Some(Self { watch, reader: ScanReader::new(StreamKind::Lms2xx, usize::MAX)?, met: HashMap::new() })
    }

    /// Whether anybody watches.
    pub(crate) fn are_watched(&self) -> bool {
        self.watch.is_watched()
    }

    /// The next scan's turns begin.
    pub(crate) fn begin(&mut self) {
        self.met.clear();
    }

    /// A mirror turn: the line that `world` has looked at.
    pub(crate) fn turn(&mut self, world: &ScannerView) {
        let Some((grid, _)) = world.sight() else { return };
        self.met.extend(angles(grid).zip(world.returns().iter().map(|met| met.class)));
    }

    /// Shows the scan that these bytes tell of, if they do. Its first mirror turn was at `at`; the line that `world` has looked at is its last.
    pub(crate) fn sent(&mut self, at: SimTime, bytes: &[u8], world: &ScannerView) {
        let Some(sight) = world.sight().filter(|_| self.are_watched()) else { return };
        self.reader.push_bytes(Duration::from_nanos(at.0), bytes);
        while let Some(event) = self.reader.next_event() {
            if event == HostEvent::Scan {
                let scan = self.reader.scan().clone();
                let met = |angle| self.met.get(&angle).copied().unwrap_or(Class::None);
                let classes = angles(scan.beams).map(met).collect();
                self.watch.show(at, scan, classes, sight);
            }
        }
    }
}

/// Device angles of all beams, 1/10000°.
fn angles(grid: BeamGrid) -> impl Iterator<Item = i32> {
    (0..i32::from(grid.count)).map(move |beam| grid.start + beam * i32::from(grid.step))
}
