//! A rig that runs.

use tokio::task::JoinSet;

use crate::lockstep::LockstepError;
use rowscan_ports::task;

/// A rig that runs. Dropping it ends its timeline, with its serial lines, GNSS lines and bus.
#[derive(Debug)]
pub struct Running {
    timeline: JoinSet<Result<(), LockstepError>>,
}

impl Running {
    pub(crate) fn new(timeline: impl Future<Output = Result<(), LockstepError>> + Send + 'static) -> Self {
        let mut tasks = JoinSet::new();
        tasks.spawn(task(timeline));
        Self { timeline: tasks }
    }

    /// Ends its timeline, and returns once that does nothing any more. Dropping it does not wait: a burst that is under way goes on beside it.
    pub async fn stop(mut self) {
        self.timeline.shutdown().await;
    }

    /// Waits until a clock in lockstep fails. Cancel safe.
    pub async fn failed(&mut self) -> LockstepError {
        match self.ended().await {
            Err(error) => error,
            Ok(()) => std::future::pending().await,
        }
    }

    /// Waits until the timeline ends by itself: at the end it was given ([`Rig::until`](crate::Rig::until)), or because a clock in lockstep
    /// fails. Cancel safe.
    pub async fn ended(&mut self) -> Result<(), LockstepError> {
        match self.timeline.join_next().await {
            Some(Ok(ended)) => ended,
            // It runs for ever otherwise.
            _ => std::future::pending().await,
        }
    }
}
