//! Host times that are measured: what a telegram takes to its user, and how late an idle task wakes.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::task::JoinSet;

use crate::clock::Stopwatch;
use crate::task::task;

/// How many telegrams that are on their way a [`Latency`] remembers; more than any client's queue holds.
const REMEMBERED: usize = 4096;

/// How many times a [`WakeLateness`] keeps: an hour and more.
const KEPT: usize = 1_000_000;

/// Host time from handing a telegram to its socket queue until its user says that it has been used.
#[derive(Debug, Default)]
pub struct Latency {
    sent: Mutex<VecDeque<(u16, Stopwatch)>>,
    measured: Mutex<Vec<Duration>>,
}

impl Latency {
    /// The telegram with this counter is on its way.
    pub fn sent(&self, telegram_counter: u16) {
        let mut sent = self.sent.lock().unwrap_or_else(PoisonError::into_inner);
        if sent.len() == REMEMBERED {
            sent.pop_front();
        }
        sent.push_back((telegram_counter, Stopwatch::start()));
    }

    /// The telegram with this counter has been used.
    pub fn used(&self, telegram_counter: u16) {
        let mut sent = self.sent.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some((counter, since)) = sent.pop_front() {
            if counter == telegram_counter {
                let mut measured = self.measured.lock().unwrap_or_else(PoisonError::into_inner);
                measured.push(since.elapsed());
                return;
            }
        }
    }

    /// The latency that `fraction` of all telegrams stayed under.
    pub fn quantile(&self, fraction: f64) -> Option<Duration> {
        quantile(&mut self.measured.lock().unwrap_or_else(PoisonError::into_inner), fraction)
    }
}

/// How late an idle task wakes: what the host itself adds to every time measured on it.
#[derive(Clone, Debug)]
pub struct WakeLateness(Arc<Mutex<Vec<Duration>>>);

impl WakeLateness {
    /// Measures from now on, every `period`, in a task of `tasks`.
    pub fn watch(period: Duration, tasks: &mut JoinSet<()>) -> Self {
        let lateness = Self(Arc::default());
        let kept = lateness.clone();
        tasks.spawn(task(async move {
            let (watch, mut due) = (Stopwatch::start(), Duration::ZERO);
            loop {
                due += period;
                watch.reach(due).await;
                let mut measured = kept.0.lock().unwrap_or_else(PoisonError::into_inner);
                if measured.len() < KEPT {
                    measured.push(watch.elapsed().saturating_sub(due));
                }
            }
        }));
        lateness
    }

    /// What was measured so far.
    pub fn measured(&self) -> Vec<Duration> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The time that `share` of `times` stayed under; sorts them.
pub fn quantile(times: &mut [Duration], share: f64) -> Option<Duration> {
    times.sort_unstable();
    let last = times.len().checked_sub(1)?;
    times.get((last as f64 * share).round() as usize).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_latency_is_of_its_own_telegram_and_lost_ones_have_none() {
        let latency = Latency::default();
        for counter in [1, 2, 3] {
            latency.sent(counter);
            tokio::time::advance(Duration::from_millis(10)).await;
        }
        // The second one was lost on the way.
        latency.used(1);
        latency.used(3);
        latency.used(2);
        let found = [0.0, 1.0].map(|fraction| latency.quantile(fraction));
        assert_eq!(found, [Some(Duration::from_millis(10)), Some(Duration::from_millis(30))]);
    }
}
