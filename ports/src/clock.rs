//! The host's clock: the one place of this crate, and of those above it that have no clock of their own, that reads it or waits for it.

use std::future::Future;
use std::time::{Duration, SystemTime};

use tokio::time::{Instant, sleep, sleep_until, timeout};

/// A short pause before trying again what the system just refused.
pub async fn retry_pause() {
    sleep(Duration::from_millis(50)).await;
}

/// Waits so long.
pub async fn rest(time: Duration) {
    sleep(time).await;
}

/// Keeps the thread for a time that is too short for timers: letting others run would cost more.
pub fn spin(time: Duration) {
    // Not tokio's clock: frozen, it would never come to an end.
    let begun = std::time::Instant::now();
    while begun.elapsed() < time {
        std::hint::spin_loop();
    }
}

/// Waits for `work`, but no longer than `limit` of host time; none if that is over first.
pub async fn within<F: Future>(limit: Duration, work: F) -> Option<F::Output> {
    timeout(limit, work).await.ok()
}

/// Reads the time of day in nanoseconds since 1970, for recordings: it runs on evenly, whatever happens to the system's clock after the start.
pub fn wall_clock_ns() -> impl Fn() -> u64 + Send + Sync {
    let began = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    let watch = Stopwatch::start();
    move || (began + watch.elapsed()).as_nanos() as u64
}

/// Host time since it was started; frozen with tokio's clock in tests.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch(Instant);

impl Stopwatch {
    /// Starts at zero.
    pub fn start() -> Self {
        Self(Instant::now())
    }

    /// Time since the start.
    pub fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }

    /// Waits until so much time has passed since the start.
    pub async fn reach(&self, since_start: Duration) {
        sleep_until(self.0 + since_start).await;
    }
}
