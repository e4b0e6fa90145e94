//! The one place of this crate that waits by the host's clock.

use std::future::Future;
use std::time::Duration;

/// How long a connection may take to send its request's head, and may stay without a request.
pub(crate) const HEAD: Duration = Duration::from_secs(10);
/// How long a request may take, body and all.
pub(crate) const BODY: Duration = Duration::from_secs(10);
/// How long an answer may wait for steps: callers are answered within a second.
pub(crate) const STEPS: Duration = Duration::from_millis(500);

/// Waits for `work`, but no longer than `limit`.
pub(crate) async fn within<F: Future>(limit: Duration, work: F) -> Option<F::Output> {
    rowscan_ports::clock::within(limit, work).await
}

/// What hyper keeps its time limits by.
pub(crate) fn hyper_timer() -> hyper_util::rt::TokioTimer {
    hyper_util::rt::TokioTimer::new()
}
