//! Waiting for a paced clock's deadlines, as finely as the system can.

use rowscan_protocol::time::SimTime;
#[cfg(target_os = "linux")]
use tokio::sync::watch;

use super::sim_clock::SimClock;
#[cfg(target_os = "linux")]
use super::sim_clock::{Due, Pace};
#[cfg(target_os = "linux")]
use super::system_timer;
#[cfg(target_os = "linux")]
use super::time_scale::TimeScale;

/// What tells paced clocks that a deadline has come: the runtime's timers (milliseconds, and frozen with its clock) unless it is
/// made as [`Timer::system`]. Clones share one timer.
#[derive(Clone, Debug, Default)]
pub struct Timer {
    #[cfg(target_os = "linux")]
    system: Option<system_timer::SystemTimer>,
}

impl Timer {
    /// The system's: tens of microseconds. The runtime's where the system has none of its own, or descriptors have run out. Called within
    /// the runtime that its clocks run in.
    pub fn system() -> Self {
        Self {
            #[cfg(target_os = "linux")]
            system: system_timer::SystemTimer::new().ok(),
        }
    }
}

/// One task's way to wait for a paced clock's deadlines, as finely as its timer can.
#[derive(Debug)]
pub(crate) struct Pacer {
    #[cfg(target_os = "linux")]
    waiter: Option<system_timer::Waiter>,
    #[cfg(target_os = "linux")]
    pace: watch::Receiver<Pace>,
}

impl Pacer {
    /// For one task that waits for `clock`.
    #[cfg(target_os = "linux")]
    pub(crate) fn new(clock: &SimClock, timer: &Timer) -> Self {
        let system = timer.system.as_ref().filter(|_| clock.scale() != TimeScale::Max);
        let waiter = system.map(|system| system.waiter(clock.since_start()));
        Self { waiter, pace: clock.pace() }
    }

    /// For one task that waits for `clock`.
    #[cfg(not(target_os = "linux"))]
    pub(crate) fn new(_clock: &SimClock, _timer: &Timer) -> Self {
        Self {}
    }

    /// Waits for the simulated instant `at`, as [`SimClock::reach`] does.
    pub(crate) async fn reach(&mut self, clock: &SimClock, at: SimTime) {
        #[cfg(target_os = "linux")]
        while let Some(waiter) = &mut self.waiter {
            let due = self.pace.borrow_and_update().due(at);
            let Due::Host(since_epoch) = due else {
                // It stands.
                let _ = self.pace.changed().await;
                continue;
            };
            tokio::select! {
                kept = waiter.reach(since_epoch) => match kept {
                    true => return clock.reached(at),
                    false => self.waiter = None,
                },
                _ = self.pace.changed() => {}
            }
        }
        clock.reach(at).await;
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use tokio::time::Instant;

    use super::*;
    use crate::clock::TimeScale;

    #[tokio::test]
    async fn the_systems_timer_never_fires_early_and_takes_deadlines_that_have_passed() {
        let clock = SimClock::start(TimeScale::Paced(1.0));
        let mut pacer = Pacer::new(&clock, &Timer::system());
        #[cfg(target_os = "linux")]
        assert!(pacer.waiter.is_some());
        for ms in [2, 5, 5, 1, 9] {
            let at = SimTime(ms * 1_000_000);
            pacer.reach(&clock, at).await;
            assert!(clock.due(at).is_some_and(|due| Instant::now().into_std() >= due), "{ms} ms");
        }
    }

    /// Many tasks at one timer: each is notified at its own instants, in order, and one that gives up does not disturb the others.
    #[tokio::test]
    async fn one_timer_serves_many() {
        let clock = std::sync::Arc::new(SimClock::start(TimeScale::Paced(1.0)));
        let timer = Timer::system();
        let mut tasks = tokio::task::JoinSet::new();
        for task in 0..50_u64 {
            let (clock, mut pacer) = (std::sync::Arc::clone(&clock), Pacer::new(&clock, &timer));
            tasks.spawn(async move {
                for turn in 1..20_u64 {
                    let at = SimTime(turn * 1_000_000 + task * 20_000);
                    if task % 7 == 0 {
                        let never = SimTime(3_600_000_000_000);
                        let given_up =
                            tokio::time::timeout(Duration::from_millis(1), pacer.reach(&clock, never)).await;
                        assert!(given_up.is_err());
                    }
                    pacer.reach(&clock, at).await;
                    assert!(clock.due(at).is_some_and(|due| Instant::now().into_std() >= due));
                }
            });
        }
        while let Some(done) = tasks.join_next().await {
            done.expect("every deadline is kept");
        }
    }
}
