//! Sleeps that cost nothing: in lockstep a participant that sleeps by the host's time with a connection open holds time, so what it does
//! then looks as if it had not slept. A report must say so.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_protocol::time::SimTime;

/// Shorter ones are the host's doing: it wakes late whom it has to.
pub(crate) const SHORTEST: Duration = Duration::from_millis(100);

/// Sleeps that are kept; of more only the first are known.
const KEPT: usize = 1000;

/// One sleep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sleep {
    /// When time was held.
    pub at: SimTime,
    /// How long, host time.
    pub took: Duration,
    /// The process that slept.
    pub process: u32,
}

/// The sleeps of a run. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct Sleeps(Arc<Mutex<Vec<Sleep>>>);

impl Sleeps {
    /// All of them so far, the first thousand.
    pub fn all(&self) -> Vec<Sleep> {
        self.lock().clone()
    }

    pub(crate) fn note(&self, sleep: Sleep) {
        let mut sleeps = self.lock();
        if sleeps.len() < KEPT {
            sleeps.push(sleep);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Sleep>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
