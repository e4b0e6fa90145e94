//! The lines of a scanner as others may watch them: what its telegram says, what the beams met, and from where they went out.

use std::sync::Arc;

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::telegram::LmdScandata;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::Class;
use tokio::sync::broadcast;

use crate::sight::{Sight, place_in};
use crate::view::ScannerView;

/// Lines that a watcher may lag behind; at 50 Hz a little over a second.
const KEPT: usize = 64;

/// One line of a scanner.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenLine {
    /// When the mirror passed its zero index.
    pub at: SimTime,
    /// What its telegram says, whoever takes it.
    pub scan: Scan,
    /// What each beam of the scan met.
    pub classes: Vec<Class>,
    /// Where the scan's beams went out.
    pub sight: Sight,
}

/// Where a scanner's lines can be watched. Clones share it. A watcher that is too slow loses lines; the scanner waits for none.
#[derive(Clone, Debug)]
pub struct LineWatch(broadcast::Sender<Arc<SeenLine>>);

impl Default for LineWatch {
    fn default() -> Self {
        Self(broadcast::Sender::new(KEPT))
    }
}

/// One who watches.
#[derive(Debug)]
pub struct LineWatcher(broadcast::Receiver<Arc<SeenLine>>);

impl LineWatch {
    /// One more watcher, of the lines from now on.
    pub fn watch(&self) -> LineWatcher {
        LineWatcher(self.0.subscribe())
    }

    /// Whether anybody watches.
    pub(crate) fn is_watched(&self) -> bool {
        self.0.receiver_count() > 0
    }

    /// Shows the line that `telegram` tells of.
    pub(crate) fn show_cola(&self, at: SimTime, telegram: &LmdScandata, world: &ScannerView) {
        let mut scan = Scan::default();
        let Some((whole, sight)) = world.sight().filter(|_| self.is_watched()) else { return };
        if telegram.to_scan_into(&mut scan).is_err() {
            return;
        }
        let (first, stride) = place_in(whole, scan.beams);
        let returns = world.returns();
        let class = |beam: usize| {
            let number = first + beam as f64 * stride;
            returns.get(number.round() as usize).map_or(Class::None, |met| met.class)
        };
        let classes = (0..scan.beams.len()).map(class).collect();
        self.show(at, scan, classes, (whole, sight));
    }

    /// Shows what a telegram says, what its beams met, and from where beams on that grid went out, of which its own are some.
    pub(crate) fn show(
        &self,
        at: SimTime,
        scan: Scan,
        classes: Vec<Class>,
        (whole, sight): (BeamGrid, Sight),
    ) {
        let sight = sight.of_part(whole, scan.beams);
        // Nobody there is no failure.
        let _ = self.0.send(Arc::new(SeenLine { at, scan, classes, sight }));
    }
}

impl LineWatcher {
    /// The next line there is, older ones that were too many left out; none once the scanner is gone. Cancel safe.
    pub async fn next(&mut self) -> Option<Arc<SeenLine>> {
        loop {
            match self.0.recv().await {
                Ok(line) => return Some(line),
                Err(broadcast::error::RecvError::Lagged(_)) => {}
                Err(broadcast::error::RecvError::Closed) => return None,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::rig::Axes;
    use rowscan_protocol::scan::Pose;

    use super::*;

    #[tokio::test]
    async fn a_slow_watcher_loses_the_oldest_lines() {
        let watch = LineWatch::default();
        let mut slow = watch.watch();
        for number in 0..KEPT as u64 + 10 {
            let scan = Scan { telegram_counter: number as u16, ..Scan::default() };
            let sight = Sight {
                origin: Pose::default(),
                axes: Axes::LEVEL,
                first_rad: 0.0,
                step_rad: 0.0,
                advance_m: 0.0,
            };
            let line = SeenLine { at: SimTime(number), scan, classes: Vec::new(), sight };
            watch.0.send(Arc::new(line)).unwrap();
        }
        drop(watch);
        assert_eq!(slow.next().await.map(|line| line.scan.telegram_counter), Some(10));
        let mut last = 10;
        while let Some(line) = slow.next().await {
            last = line.scan.telegram_counter;
        }
        assert_eq!(last, KEPT as u16 + 9);
    }
}
