//! What has been handed to the tasks that write, and is not written yet.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::sync::Notify;

/// Counts pending output, for a command that must flush it before it goes on or exits.
#[derive(Clone, Debug, Default)]
pub struct InFlight(Arc<Counted>);

#[derive(Debug, Default)]
struct Counted {
    pending: AtomicU64,
    fewer: Notify,
}

/// Travels with one item of pending output; dropped once the item is written, or lost with the queue it was in.
#[derive(Debug)]
pub struct Pending(InFlight);

impl InFlight {
    /// One more item is pending.
    pub fn enter(&self) -> Pending {
        self.0.pending.fetch_add(1, Ordering::Relaxed);
        Pending(self.clone())
    }

    /// Items that are pending.
    pub fn pending(&self) -> u64 {
        self.0.pending.load(Ordering::Acquire)
    }

    /// Waits until nothing is pending. Cancel safe.
    pub async fn flushed(&self) {
        self.below(1).await;
    }

    /// Waits until fewer than `limit` items are pending. Cancel safe.
    pub async fn below(&self, limit: u64) {
        loop {
            let fewer = self.0.fewer.notified();
            if self.pending() < limit {
                return;
            }
            fewer.await;
        }
    }
}

impl Clone for Pending {
    fn clone(&self) -> Self {
        self.0.enter()
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        self.0.0.pending.fetch_sub(1, Ordering::AcqRel);
        self.0.0.fewer.notify_waiters();
    }
}

#[cfg(test)]
mod tests {
    use std::pin::Pin;
    use std::task::{Context, Poll, Waker};

    use super::*;

    fn poll_once(future: Pin<&mut impl Future<Output = ()>>) -> Poll<()> {
        future.poll(&mut Context::from_waker(Waker::noop()))
    }

    #[tokio::test]
    async fn output_is_flushed_once_all_copies_are_dropped() {
        let in_flight = InFlight::default();
        in_flight.flushed().await;
        let (queue, queued) = tokio::sync::mpsc::channel(4);
        let written = in_flight.enter();
        for pending in [written.clone(), written.clone()] {
            queue.send(pending).await.unwrap();
        }
        let mut flushed = std::pin::pin!(in_flight.flushed());
        let mut below = std::pin::pin!(in_flight.below(3));
        assert!(poll_once(flushed.as_mut()).is_pending(), "three are pending");
        assert!(poll_once(below.as_mut()).is_pending(), "three are not fewer than three");
        drop(written);
        assert!(poll_once(flushed.as_mut()).is_pending(), "two are in the queue");
        assert!(poll_once(below.as_mut()).is_ready());
        // A writer that ends drops its queue.
        drop(queued);
        assert!(poll_once(flushed.as_mut()).is_ready());
    }
}
