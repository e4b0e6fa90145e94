//! Scans on their way through the faults of a stream: how many wait, and how many never left.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rowscan_ports::in_flight::{InFlight, Pending};

/// Counts the scans of a stream, over all its connections.
#[derive(Clone, Debug, Default)]
pub(crate) struct ScanCounts(Arc<Counted>);

#[derive(Debug, Default)]
struct Counted {
    held: InFlight,
    lost: AtomicU64,
    given_up: AtomicBool,
}

/// A scan in a lane. It has left once [`InLane::leave`] is called; dropped before that, it is lost.
#[derive(Debug)]
pub(crate) struct InLane {
    counts: ScanCounts,
    left: bool,
    _pending: Pending,
}

impl ScanCounts {
    pub(crate) fn enter(&self) -> InLane {
        InLane { counts: self.clone(), left: false, _pending: self.0.held.enter() }
    }

    /// Those that wait.
    pub(crate) fn held(&self) -> &InFlight {
        &self.0.held
    }

    /// Those that never left. What was given up is counted by whoever has done so.
    pub(crate) fn lost(&self) -> u64 {
        self.0.lost.load(Ordering::Relaxed)
    }

    /// What waits is lost from here on, and not counted here.
    pub(crate) fn give_up(&self) {
        self.0.given_up.store(true, Ordering::Relaxed);
    }
}

impl InLane {
    pub(crate) fn leave(mut self) {
        self.left = true;
    }
}

impl Drop for InLane {
    fn drop(&mut self) {
        let Counted { lost, given_up, .. } = &*self.counts.0;
        if !self.left && !given_up.load(Ordering::Relaxed) {
            lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_has_left_or_is_lost_or_was_given_up() {
        let counts = ScanCounts::default();
        let [first, second, third] = [counts.enter(), counts.enter(), counts.enter()];
        assert_eq!((counts.held().pending(), counts.lost()), (3, 0));
        first.leave();
        drop(second);
        assert_eq!((counts.held().pending(), counts.lost()), (1, 1));
        counts.give_up();
        drop(third);
        assert_eq!((counts.held().pending(), counts.lost()), (0, 1));
    }
}
