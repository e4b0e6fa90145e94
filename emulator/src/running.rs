//! A rig that runs.

use tokio::task::JoinSet;

/// A rig that runs. Dropping it ends its timeline, with its serial lines, GNSS lines and bus.
#[derive(Debug)]
pub struct Running {
    _timeline: JoinSet<()>,
}

impl Running {
    pub(crate) fn new(timeline: impl Future<Output = ()> + Send + 'static) -> Self {
        let mut tasks = JoinSet::new();
        tasks.spawn(timeline);
        Self { _timeline: tasks }
    }
}
