//! The one place of this crate that knows the host's clock.

use std::time::Duration;

use tokio::time::{Instant, sleep_until};

/// Host time since the connection was opened; monotonic, and frozen with tokio's clock in tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct HostTime(pub Duration);

/// By how much a host that is held up may find a deadline passed and still read first what has come before it.
pub(crate) const HELD_UP: Duration = Duration::from_secs(1);

/// Counts host time from its making.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch {
    epoch: Instant,
}

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self { epoch: Instant::now() }
    }

    pub(crate) fn now(&self) -> Duration {
        self.epoch.elapsed()
    }

    /// Sleeps until `deadline` on this watch; for ever without one.
    pub(crate) async fn until(&self, deadline: Option<Duration>) {
        match deadline {
            Some(deadline) => sleep_until(self.epoch + deadline).await,
            None => std::future::pending().await,
        }
    }
}
