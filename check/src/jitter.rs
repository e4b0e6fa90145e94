//! How late this machine wakes a task that waits: on a paced clock nothing can be judged more finely.

use std::fmt;
use std::time::Duration;

use rowscan_ports::latency::{WakeLateness, quantile};
use tokio::task::JoinSet;

/// Between two measurements, host time.
const EVERY: Duration = Duration::from_millis(10);

/// Measures until it is dropped.
#[derive(Debug)]
pub(crate) struct JitterWatch {
    lateness: WakeLateness,
    _task: JoinSet<()>,
}

/// What was measured in a run, host time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Jitter {
    pub(crate) p50: Duration,
    pub(crate) p99: Duration,
    pub(crate) worst: Duration,
}

impl JitterWatch {
    pub(crate) fn start() -> Self {
        let mut task = JoinSet::new();
        Self { lateness: WakeLateness::watch(EVERY, &mut task), _task: task }
    }

    /// What was measured so far; none where the run was too short.
    pub(crate) fn measured(&self) -> Option<Jitter> {
        let mut times = self.lateness.measured();
        let mut of = |share| quantile(&mut times, share);
        Some(Jitter { p50: of(0.5)?, p99: of(0.99)?, worst: of(1.0)? })
    }
}

impl fmt::Display for Jitter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ms = |time: Duration| time.as_secs_f64() * 1e3;
        write!(f, "p50 {:.1} ms, p99 {:.1} ms, worst {:.1} ms", ms(self.p50), ms(self.p99), ms(self.worst))
    }
}
