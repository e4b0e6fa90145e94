//! Orders that wait for their instants.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rowscan_protocol::time::SimTime;
use tokio::sync::Notify;

/// Orders of one part, in the order of their instants; at one instant in the order they were given.
#[derive(Debug)]
pub(crate) struct Orders<T> {
    pending: Mutex<Vec<(SimTime, T)>>,
    /// Has the timeline look again.
    changed: Arc<Notify>,
}

impl<T> Orders<T> {
    pub(crate) fn new(changed: &Arc<Notify>) -> Self {
        Self { pending: Mutex::default(), changed: Arc::clone(changed) }
    }

    pub(crate) fn push(&self, at: SimTime, order: T) {
        let mut pending = self.lock();
        let place = pending.partition_point(|(other, _)| *other <= at);
        pending.insert(place, (at, order));
        drop(pending);
        self.changed.notify_one();
    }

    /// Takes back what is not done yet.
    pub(crate) fn retract(&self, which: impl Fn(&T) -> bool) -> bool {
        let mut pending = self.lock();
        let before = pending.len();
        pending.retain(|(_, order)| !which(order));
        pending.len() < before
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        self.lock().first().map(|(at, _)| *at)
    }

    /// The next order that is due by `now`.
    pub(crate) fn take(&self, now: SimTime) -> Option<(SimTime, T)> {
        let mut pending = self.lock();
        let is_due = pending.first().is_some_and(|(at, _)| *at <= now);
        is_due.then(|| pending.remove(0))
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(SimTime, T)>> {
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
