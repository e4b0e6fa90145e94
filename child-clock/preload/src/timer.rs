//! What a descriptor is as a timer.

use libc::itimerspec;
use rowscan_child_clock::ChildPage;

use crate::instant::{Clock, timespec_of};
use crate::lock::Lock;

/// The timer of one descriptor.
pub(crate) struct Timer(Lock<State>);

#[derive(Clone, Copy)]
pub(crate) struct State {
    /// None: it is no timer.
    pub(crate) clock: Option<Clock>,
    pub(crate) slot: Option<usize>,
    pub(crate) deadline_ns: u64,
    /// From one expiration to the next; 0: there is one only.
    pub(crate) interval_ns: u64,
}

impl State {
    pub(crate) const NO_TIMER: Self = Self { clock: None, slot: None, deadline_ns: 0, interval_ns: 0 };

    /// A timer by `clock` that is not set.
    pub(crate) fn unset(clock: Clock) -> Self {
        Self { clock: Some(clock), ..Self::NO_TIMER }
    }

    /// As `timerfd_gettime` tells it.
    pub(crate) fn setting(&self, page: &ChildPage) -> itimerspec {
        let left = if self.slot.is_some() { self.deadline_ns.saturating_sub(page.now_ns()) } else { 0 };
        itimerspec { it_interval: timespec_of(self.interval_ns), it_value: timespec_of(left) }
    }
}

impl Timer {
    pub(crate) const fn new() -> Self {
        Self(Lock::new(State::NO_TIMER))
    }

    pub(crate) fn state(&self) -> State {
        *self.0.lock()
    }

    /// Sets it; how it was before.
    pub(crate) fn set(&self, state: State) -> State {
        std::mem::replace(&mut *self.0.lock(), state)
    }

    /// An expiration has been told; when the next one is, if there is one.
    pub(crate) fn expired(&self) -> Option<u64> {
        let mut state = self.0.lock();
        if state.interval_ns == 0 || state.clock.is_none() {
            (state.slot, state.deadline_ns) = (None, 0);
            return None;
        }
        state.deadline_ns = state.deadline_ns.saturating_add(state.interval_ns);
        Some(state.deadline_ns)
    }

    /// In a forked child nobody holds it, and no keeper of its parent's tells its expirations.
    pub(crate) fn forked(&self) {
        self.0.open();
        self.0.lock().slot = None;
    }
}
