//! The one place of this crate, and of those above it that have no clock of their own, that sleeps by the host's clock.

use std::future::Future;
use std::time::Duration;

/// A short pause before trying again what the system just refused.
pub async fn retry_pause() {
    tokio::time::sleep(Duration::from_millis(50)).await;
}

/// Waits for `work`, but no longer than `limit` of host time; none if that is over first.
pub async fn within<F: Future>(limit: Duration, work: F) -> Option<F::Output> {
    tokio::time::timeout(limit, work).await.ok()
}
