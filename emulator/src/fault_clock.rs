//! Faults by the simulated clock.

use std::sync::Arc;
use std::time::Duration;

use rowscan_faults::{Clock, Wait};
use rowscan_protocol::time::SimTime;

use crate::clock::SimClock;

impl Clock for SimClock {
    fn now(&self) -> Duration {
        SimClock::now(self).elapsed()
    }

    fn wait_until(self: Arc<Self>, at: Duration) -> Wait {
        Box::pin(async move { self.passes(SimTime::ZERO + at).await })
    }

    fn is_patient(&self) -> bool {
        self.delivery().is_patient()
    }
}
