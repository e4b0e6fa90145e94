//! The only place of this crate that reads the host's clock or sleeps.

use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::time::{Instant, Sleep, sleep_until};

/// Host time since the scanner was opened; monotonic, and frozen with tokio's clock in tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct HostTime(pub Duration);

/// A host that was suspended may find a deadline passed by this much and still reads first what arrived before it.
pub(crate) const LATE_HOST: Duration = Duration::from_secs(1);

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
}

/// The timer of a state machine. It outlives the future that polls it, so a deadline does not start again with the next future.
#[derive(Debug)]
pub(crate) struct Timer {
    watch: Stopwatch,
    sleep: Option<Pin<Box<Sleep>>>,
}

impl Timer {
    pub(crate) fn new(watch: Stopwatch) -> Self {
        Self { watch, sleep: None }
    }

    /// Ready once it is `deadline` on the watch; never without one.
    pub(crate) fn poll(&mut self, cx: &mut Context<'_>, deadline: Option<Duration>) -> Poll<()> {
        let Some(at) = deadline.and_then(|deadline| self.watch.epoch.checked_add(deadline)) else {
            return Poll::Pending;
        };
        let sleep = self.sleep.get_or_insert_with(|| Box::pin(sleep_until(at)));
        if sleep.deadline() != at {
            sleep.as_mut().reset(at);
        }
        sleep.as_mut().poll(cx)
    }
}
