//! The one place of the bench that reads the host's clock and waits for it.

use std::time::{Duration, Instant, SystemTime};

/// How long something has taken, host time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stopwatch(Instant);

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self(Instant::now())
    }

    pub(crate) fn elapsed(self) -> Duration {
        self.0.elapsed()
    }
}

/// The host's date and time.
pub(crate) fn date() -> SystemTime {
    SystemTime::now()
}

/// A pause between two looks at something that nobody tells of.
pub(crate) async fn look_again() {
    tokio::time::sleep(Duration::from_millis(20)).await;
}

/// A short pause between two looks at something that a child waits for.
pub(crate) async fn look_closely() {
    tokio::time::sleep(Duration::from_millis(2)).await;
}

/// Waits so long for something; none if it has not come.
pub(crate) async fn within<T>(time: Duration, what: impl Future<Output = T>) -> Option<T> {
    tokio::time::timeout(time, what).await.ok()
}

/// Waits so long.
pub(crate) async fn rest(time: Duration) {
    tokio::time::sleep(time).await;
}
