//! How many steps time may take, and how many it has taken.

use std::sync::{Arc, Mutex, PoisonError};

use rowscan_protocol::time::SimTime;
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
    /// When the last one ended.
    at: SimTime,
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

    /// One more was taken; it ended at `at`. After the last that was granted, `clock` is closed before anyone hears of it.
    pub(crate) fn take(&self, at: SimTime, clock: &SimClock) {
        let _changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = self.taken() + 1;
        if self.granted().is_some_and(|granted| taken >= granted) {
            clock.gate(true);
        }
        self.state.send_modify(|state| (state.taken, state.at) = (taken, at));
    }

    /// Closes `clock` if all that was granted is taken.
    pub(crate) fn gate(&self, clock: &SimClock) -> bool {
        let _changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
        let used_up = self.is_used_up();
        clock.gate(used_up);
        used_up
    }

    /// Grants `more` steps beyond those granted, or beyond those taken where nothing was counted; how many that is in all.
    pub(crate) fn grant(&self, more: u64, clock: &SimClock) -> u64 {
        let mut all = 0;
        {
            let _changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
            self.state.send_modify(|state| {
                all = state.granted.unwrap_or(state.taken).saturating_add(more);
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
