//! A virtual LMS2xx as its user holds it.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use crate::lms2xx::{Counts, Lms2xxScanner, SerialCounts};
use crate::playback_queue::PlaybackQueue;
use crate::running::Running;

/// A running virtual LMS2xx.
#[derive(Debug)]
pub struct SerialEmulator {
    counts: Arc<Counts>,
    /// Where its recorded telegrams go, if it is a recorded one.
    queue: Option<PlaybackQueue>,
    /// Where it does not run with the rig it belongs to.
    #[expect(dead_code, reason = "its drop ends the timeline")]
    running: Option<Running>,
}

impl SerialEmulator {
    pub(crate) fn of(scanner: &Lms2xxScanner) -> Self {
        Self { counts: Arc::clone(&scanner.counts), queue: None, running: None }
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
        counts(&self.counts, self.queue.as_ref())
    }

    /// Tells what it has done.
    pub fn counting(&self) -> impl Fn() -> SerialCounts + Send + Sync + use<> {
        let counted = Arc::clone(&self.counts);
        let queue = self.queue.clone();
        move || counts(&counted, queue.as_ref())
    }
}

fn counts(counts: &Counts, queue: Option<&PlaybackQueue>) -> SerialCounts {
    SerialCounts {
        scans_sent: counts.sent.load(Ordering::Relaxed).saturating_sub(queue.map_or(0, PlaybackQueue::lost)),
        scans_dropped: queue.map(PlaybackQueue::dropped),
        bytes_lost: counts.lost.load(Ordering::Relaxed),
    }
}
