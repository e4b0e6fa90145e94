//! What has been handed to the tasks that write, and is not out yet.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::sync::Notify;

/// Counts what is under way; for who wants it out before he goes on, or goes.
#[derive(Clone, Debug, Default)]
pub struct Backlog(Arc<Counted>);

#[derive(Debug, Default)]
struct Counted {
    under_way: AtomicU64,
    clear: Notify,
}

/// Goes along with what is under way and is dropped once that is out, or lost with the queue it was in.
#[derive(Debug)]
pub struct UnderWay(Backlog);

impl Backlog {
    /// One thing more is under way.
    pub fn enter(&self) -> UnderWay {
        self.0.under_way.fetch_add(1, Ordering::Relaxed);
        UnderWay(self.clone())
    }

    /// Waits until nothing is under way. Cancel safe.
    pub async fn clear(&self) {
        loop {
            let clear = self.0.clear.notified();
            if self.0.under_way.load(Ordering::Acquire) == 0 {
                return;
            }
            clear.await;
        }
    }
}

impl Clone for UnderWay {
    fn clone(&self) -> Self {
        self.0.enter()
    }
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        if self.0.0.under_way.fetch_sub(1, Ordering::AcqRel) == 1 {
            self.0.0.clear.notify_waiters();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn it_is_clear_once_all_copies_are_gone_however_they_went() {
        let backlog = Backlog::default();
        backlog.clear().await;
        let (queue, queued) = tokio::sync::mpsc::channel(4);
        let written = backlog.enter();
        for slip in [written.clone(), written.clone()] {
            queue.send(slip).await.unwrap();
        }
        let mut clear = std::pin::pin!(backlog.clear());
        assert!(poll_once(&mut clear).is_none(), "three are under way");
        drop(written);
        assert!(poll_once(&mut clear).is_none(), "two are in the queue");
        // A writer that ends takes its queue along.
        drop(queued);
        clear.await;
    }

    /// Polls once.
    fn poll_once<F: Future>(future: &mut std::pin::Pin<&mut F>) -> Option<F::Output> {
        let mut cx = std::task::Context::from_waker(std::task::Waker::noop());
        match future.as_mut().poll(&mut cx) {
            std::task::Poll::Ready(output) => Some(output),
            std::task::Poll::Pending => None,
        }
    }
}
