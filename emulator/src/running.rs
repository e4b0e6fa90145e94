//! A rig that runs.

use tokio::sync::oneshot;
use tokio::task::JoinSet;

use crate::lockstep::LockstepError;
use crate::timeline::Timeline;
use rowscan_ports::task;

/// A rig that runs. Dropping it ends its timeline, with its serial lines, GNSS lines and bus. At the end of its time these stand still: nobody's line is cut
/// inside a telegram because the time is over.
#[derive(Debug)]
pub struct Running {
    timeline: JoinSet<()>,
    ended: Option<oneshot::Receiver<Result<(), LockstepError>>>,
}

impl Running {
    pub(crate) fn new(mut timeline: Timeline) -> Self {
        let (tell, ended) = oneshot::channel();
        let mut tasks = JoinSet::new();
        tasks.spawn(task(async move {
            let _ = tell.send(timeline.run().await);
            std::future::pending::<()>().await;
        }));
        Self { timeline: tasks, ended: Some(ended) }
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
        let ended = match &mut self.ended {
            Some(ended) => ended.await,
            None => std::future::pending().await,
        };
        self.ended = None;
        match ended {
            Ok(ended) => ended,
            // It runs for ever otherwise.
            Err(_) => std::future::pending().await,
        }
    }
}
