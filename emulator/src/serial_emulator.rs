//! A virtual LMS2xx as its user holds it.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use rowscan_faults::StreamFaults;
use rowscan_ports::in_flight::InFlight;

use crate::lms2xx::{Counts, Lms2xxScanner, SerialCounts};
use crate::playback_queue::PlaybackQueue;
use crate::running::Running;

/// A running virtual LMS2xx.
#[derive(Debug)]
pub struct SerialEmulator {
    counts: Arc<Counts>,
    /// Where its recorded telegrams go, if it is a recorded one.
    queue: Option<PlaybackQueue>,
    /// What goes wrong on its line, if anything may.
    faults: Option<StreamFaults>,
    /// Where it does not run with the rig it belongs to.
    #[expect(dead_code, reason = "its drop ends the timeline")]
    running: Option<Running>,
}

impl SerialEmulator {
    pub(crate) fn of(scanner: &Lms2xxScanner) -> Self {
        let faults = scanner.faults().cloned();
        Self { counts: Arc::clone(&scanner.counts), queue: None, faults, running: None }
    }

    /// The same with the rig that it runs with and that ends with it.
    pub(crate) fn with_rig(self, running: Running) -> Self {
        Self { running: Some(running), ..self }
    }

    /// The same with the queue that its recorded telegrams come from.
    pub(crate) fn with_queue(self, queue: PlaybackQueue) -> Self {
        Self { queue: Some(queue), ..self }
    }

    /// The way to play to it; none if it looks by itself.
    pub(crate) fn playback_queue(&self) -> Option<&PlaybackQueue> {
        self.queue.as_ref()
    }

    /// What it has done so far.
    pub fn counts(&self) -> SerialCounts {
        self.counting()()
    }

    /// Tells what it has done.
    pub fn counting(&self) -> impl Fn() -> SerialCounts + Send + Sync + use<> {
        let counted = Arc::clone(&self.counts);
        let (queue, faults) = (self.queue.clone(), self.faults.clone());
        move || {
            let given_up = counted.given_up.load(Ordering::Relaxed);
            let (dropped, lost) = queue.as_ref().map_or((0, 0), |queue| (queue.dropped(), queue.lost()));
            SerialCounts {
                scans_sent: counted.sent.load(Ordering::Relaxed).saturating_sub(lost + given_up),
                scans_dropped: (queue.is_some() || faults.is_some()).then_some(dropped + given_up),
                scans_missed: counted.missed.load(Ordering::Relaxed),
                scans_kept_by_faults: faults.as_ref().map(StreamFaults::lost),
                bytes_lost: counted.lost.load(Ordering::Relaxed),
            }
        }
    }

    /// Scans that faults hold back on its line; none where nothing can go wrong there.
    pub(crate) fn held(&self) -> Option<InFlight> {
        self.faults.as_ref().map(|faults| faults.held().clone())
    }

    /// Counts what faults still hold back as dropped.
    pub(crate) fn give_up_held(&self) {
        let held = self.faults.as_ref().map_or(0, StreamFaults::give_up);
        self.counts.given_up.fetch_add(held, Ordering::Relaxed);
    }
}
