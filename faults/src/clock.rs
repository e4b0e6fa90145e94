//! Where time comes from. The only place of this crate that reads the host's clock or waits for it.

use std::fmt;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use tokio::time::{Instant, sleep_until};

/// A wait for an instant.
pub type Wait = Pin<Box<dyn Future<Output = ()> + Send>>;

/// The time that faults are scripted in.
pub trait Clock: Send + Sync + fmt::Debug {
    /// Time since its zero.
    fn now(&self) -> Duration;

    /// Waits until it is `at`; it may end late, never early.
    fn wait_until(self: Arc<Self>, at: Duration) -> Wait;

    /// True if time itself waits for whoever takes the bytes. Then what a fault holds back must never block the writer: time would
    /// wait for the fault, and the fault for time.
    fn is_patient(&self) -> bool {
        false
    }
}

/// The host's clock, zero at its start; virtual where tokio's time is paused.
#[derive(Debug)]
pub struct HostClock {
    epoch: Instant,
}

impl HostClock {
    /// Starts at zero, now.
    pub fn start() -> Self {
        Self { epoch: Instant::now() }
    }
}

impl Clock for HostClock {
    fn now(&self) -> Duration {
        self.epoch.elapsed()
    }

    fn wait_until(self: Arc<Self>, at: Duration) -> Wait {
        match self.epoch.checked_add(at) {
            Some(at) => Box::pin(sleep_until(at)),
            None => Box::pin(std::future::pending()),
        }
    }
}

/// One task's wait for whatever instant it wants next.
pub(crate) struct Timer {
    clock: Arc<dyn Clock>,
    waiting: Option<(Duration, Wait)>,
}

impl Timer {
    pub(crate) fn new(clock: Arc<dyn Clock>) -> Self {
        Self { clock, waiting: None }
    }

    /// Ready once it is `at`; never without one.
    pub(crate) fn poll(
        &mut self,
        cx: &mut std::task::Context<'_>,
        at: Option<Duration>,
    ) -> std::task::Poll<()> {
        let Some(at) = at else { return std::task::Poll::Pending };
        if self.waiting.as_ref().is_none_or(|(waited, _)| *waited != at) {
            self.waiting = Some((at, Arc::clone(&self.clock).wait_until(at)));
        }
        let polled =
            self.waiting.as_mut().map_or(std::task::Poll::Pending, |(_, wait)| wait.as_mut().poll(cx));
        if polled.is_ready() {
            self.waiting = None;
        }
        polled
    }
}

impl fmt::Debug for Timer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Timer").field("at", &self.waiting.as_ref().map(|(at, _)| at)).finish()
    }
}
