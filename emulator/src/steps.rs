//! How many steps time may take, and how many it has taken.

use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::{Notify, watch};

use crate::clock::SimClock;

/// What was granted and taken. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct Steps {
    state: Arc<watch::Sender<State>>,
    /// Kept while a grant and the clock's gate change together.
    changing: Arc<Mutex<()>>,
    /// Notified so that the timeline looks again.
    changed: Arc<Notify>,
}

#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// Steps that may be taken in all; without one, as many as come.
    granted: Option<u64>,
    taken: u64,
    /// One is being taken.
    acting: bool,
}

impl Steps {
    pub(crate) fn new(changed: Arc<Notify>) -> Self {
        Self { state: Arc::new(watch::Sender::default()), changing: Arc::default(), changed }
    }

    /// No step is taken that was not granted, from the first one on.
    pub(crate) fn by_grant(&self) {
        self.state.send_modify(|state| state.granted = state.granted.or(Some(0)));
    }

    /// Steps granted in all, where they are counted.
    pub(crate) fn granted(&self) -> Option<u64> {
        self.state.borrow().granted
    }

    pub(crate) fn taken(&self) -> u64 {
        self.state.borrow().taken
    }

    /// All that was granted is taken.
    pub(crate) fn is_used_up(&self) -> bool {
        let state = self.state.borrow();
        state.granted.is_some_and(|granted| state.taken >= granted)
    }

    /// One more begins.
    pub(crate) fn begin(&self) {
        let _changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
        self.state.send_modify(|state| state.acting = true);
    }

    /// One more was taken. After the last that was granted, `clock` is closed before anyone hears of it.
    pub(crate) fn take(&self, clock: &SimClock) {
        let _changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = self.taken() + 1;
        if self.granted().is_some_and(|granted| taken >= granted) {
            clock.gate(true);
        }
        self.state.send_modify(|state| *state = State { taken, acting: false, ..*state });
    }

    /// Closes `clock` if all that was granted is taken.
    pub(crate) fn gate(&self, clock: &SimClock) -> bool {
        let _changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
        let used_up = self.is_used_up();
        clock.gate(used_up);
        used_up
    }

    /// Grants `more` steps beyond those granted, or beyond those begun where nothing was counted; how many that is in all.
    pub(crate) fn grant(&self, more: u64, clock: &SimClock) -> u64 {
        let mut all = 0;
        {
            let _changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
            self.state.send_modify(|state| {
                let begun = state.taken + u64::from(state.acting);
                all = state.granted.unwrap_or(begun).saturating_add(more);
                state.granted = Some(all);
            });
            clock.gate(self.is_used_up());
        }
        self.changed.notify_one();
        all
    }

    /// Counts no longer.
    pub(crate) fn free(&self, clock: &SimClock) {
        {
            let _changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
            self.state.send_modify(|state| state.granted = None);
            clock.gate(false);
        }
        self.changed.notify_one();
    }

    /// Waits until so many are taken. Cancel safe.
    pub(crate) async fn reach(&self, taken: u64) {
        // The sender is part of this.
        let _ = self.state.subscribe().wait_for(|state| state.taken >= taken).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::TimeScale;

    #[tokio::test]
    async fn a_step_that_has_begun_is_none_of_those_granted_later() {
        let clock = SimClock::start(TimeScale::Paced(1.0));
        let steps = Steps::new(Arc::default());
        steps.begin();
        let last = steps.grant(2, &clock);
        for number in 1..=last {
            assert!(!steps.is_used_up(), "step {number} of {last}");
            steps.take(&clock);
        }
        assert_eq!((last, steps.is_used_up()), (3, true));
        assert_eq!(steps.grant(1, &clock), 4, "beyond those granted");
    }
}
