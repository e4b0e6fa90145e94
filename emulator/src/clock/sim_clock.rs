//! Simulated time as the host sees it. The one place of the emulator that reads the host's clock: everything else runs on simulated time.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use rowscan_ports::Delivery;
use rowscan_protocol::time::SimTime;
use tokio::sync::{Notify, watch};
use tokio::time::{Instant, sleep_until};

use super::time_scale::{TimeScale, TimeScaleError};

/// How far the timeline may be behind when the pace changes: a minute of scans is passed over in an instant.
const MOST_BEHIND: SimTime = SimTime(60_000_000_000);

/// Simulated time as the host sees it.
#[derive(Debug)]
pub struct SimClock {
    epoch: Instant,
    pace: watch::Sender<Pace>,
    /// The latest instant the mirror reached, ns; what time it is while the clock waits for its clients.
    reached: AtomicU64,
    /// When the timeline acts next, ns; the end of time where nobody has said.
    expected: AtomicU64,
    /// Notified when it gets further.
    moved: Notify,
}

/// How time runs since somebody changed that last.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    scale: TimeScale,
    /// The host's instant that it runs from, since the epoch.
    from: Duration,
    /// The simulated instant that it runs from.
    at: SimTime,
    /// Somebody has stopped it.
    paused: bool,
    /// All steps that were granted are taken.
    gated: bool,
}

/// When a simulated instant comes, by the host.
pub(super) enum Due {
    /// So long after the epoch.
    Host(Duration),
    /// As soon as the clients let it.
    AtOnce,
    /// Not while time stands.
    Never,
}

impl Pace {
    fn stands(&self) -> bool {
        self.paused || self.gated
    }

    pub(super) fn due(&self, at: SimTime) -> Due {
        match self.scale {
            _ if self.stands() => Due::Never,
            TimeScale::Paced(scale) => {
                Due::Host(self.from + host_time(SimTime(at.0.saturating_sub(self.at.0)), scale))
            }
            TimeScale::Max => Due::AtOnce,
        }
    }
}

impl SimClock {
    /// Starts simulated time at zero, now.
    pub fn start(scale: TimeScale) -> Self {
        let pace = Pace { scale, from: Duration::ZERO, at: SimTime::ZERO, paused: false, gated: false };
        let epoch = Instant::now();
        Self {
            epoch,
            pace: watch::Sender::new(pace),
            reached: AtomicU64::new(0),
            expected: AtomicU64::new(u64::MAX),
            moved: Notify::new(),
        }
    }

    /// Host time since it was started.
    pub(super) fn since_start(&self) -> Duration {
        self.epoch.elapsed()
    }

    /// How time runs, and each change of that.
    pub(super) fn pace(&self) -> watch::Receiver<Pace> {
        self.pace.subscribe()
    }

    /// The host's instant that `at` is due at, on a paced clock that runs.
    pub fn due(&self, at: SimTime) -> Option<std::time::Instant> {
        match self.pace.borrow().due(at) {
            Due::Host(since_epoch) => Some((self.epoch + since_epoch).into_std()),
            Due::AtOnce | Due::Never => None,
        }
    }

    /// How long ago `at` was due; nothing while the clock waits for its clients or stands.
    pub fn lateness(&self, at: SimTime) -> Duration {
        self.due(at).map_or(Duration::ZERO, |due| Instant::now().into_std().saturating_duration_since(due))
    }

    /// The scale.
    pub fn scale(&self) -> TimeScale {
        self.pace.borrow().scale
    }

    /// What happens to data that somebody is too slow for.
    pub fn delivery(&self) -> Delivery {
        self.scale().delivery()
    }

    /// Simulated time now.
    pub fn now(&self) -> SimTime {
        self.now_at(&self.pace.borrow())
    }

    fn now_at(&self, pace: &Pace) -> SimTime {
        let reached = SimTime(self.reached.load(Ordering::Relaxed));
        match pace.scale {
            _ if pace.stands() => reached.max(pace.at),
            TimeScale::Paced(scale) => {
                let since = self.epoch.elapsed().saturating_sub(pace.from);
                reached.max(SimTime(pace.at.0.saturating_add((since.as_nanos() as f64 * scale) as u64)))
            }
            TimeScale::Max => reached,
        }
    }

    /// True if somebody has paused it.
    pub fn is_paused(&self) -> bool {
        self.pace.borrow().paused
    }

    /// Stops time, or lets it run on from where it stood. Clients are answered meanwhile.
    pub fn pause(&self, paused: bool) {
        self.change(|pace| pace.paused = paused);
    }

    /// Lets time run so many times as fast as the host's from now on.
    ///
    /// # Errors
    /// The clock waits for its clients: its pace is theirs.
    pub fn set_scale(&self, scale: f64) -> Result<(), TimeScaleError> {
        let asked = scale.to_string().parse()?;
        if self.delivery().is_patient() {
            return Err(TimeScaleError::NotPaced);
        }
        self.change(|pace| pace.scale = asked);
        Ok(())
    }

    /// Whether all steps that were granted are taken; then time stands.
    pub(crate) fn gate(&self, gated: bool) {
        if self.pace.borrow().gated != gated {
            self.change(|pace| pace.gated = gated);
        }
    }

    /// Time goes on from where the host has come: what it had no time for by far is not lived, or all of it would be due at once.
    fn change(&self, change: impl FnOnce(&mut Pace)) {
        self.pace.send_modify(|pace| {
            let lived = SimTime(self.expected.load(Ordering::Relaxed).saturating_add(MOST_BEHIND.0));
            pace.at = self.now_at(pace).min(lived.max(pace.at));
            pace.from = self.epoch.elapsed();
            change(pace);
        });
    }

    /// Waits for the simulated instant `at`: until its absolute host deadline if paced; else it only lets others run, so that no
    /// loop that turns as fast as it can keeps its thread for itself.
    pub async fn reach(&self, at: SimTime) {
        loop {
            self.waited(at).await;
            // Somebody may have stopped time after the deadline came and before this went on: then it has not come to `at`.
            let pace = self.pace.borrow();
            if !pace.stands() {
                self.reached(at);
                return;
            }
        }
    }

    /// Waits as long as time stands, and until the host's deadline if paced.
    async fn waited(&self, at: SimTime) {
        let mut pace = self.pace.subscribe();
        loop {
            let due = pace.borrow_and_update().due(at);
            match due {
                Due::AtOnce => return tokio::task::yield_now().await,
                Due::Host(since_epoch) => tokio::select! {
                    () = sleep_until(self.epoch + since_epoch) => return,
                    // The sender is part of this.
                    _ = pace.changed() => {}
                },
                Due::Never => {
                    let _ = pace.changed().await;
                }
            }
        }
    }

    /// The timeline acts next at `at`.
    pub(crate) fn expect(&self, at: SimTime) {
        self.expected.store(at.0, Ordering::Relaxed);
    }

    /// Simulated time has come to `at`.
    pub(crate) fn reached(&self, at: SimTime) {
        self.reached.fetch_max(at.0, Ordering::Relaxed);
        self.moved.notify_waiters();
    }

    /// Waits until it is `at`, and moves nothing: for whoever follows time and does not make it.
    pub(crate) async fn passes(&self, at: SimTime) {
        if let TimeScale::Paced(_) = self.scale() {
            return self.waited(at).await;
        }
        loop {
            let mut moved = std::pin::pin!(self.moved.notified());
            moved.as_mut().enable();
            if self.now() >= at {
                return;
            }
            moved.await;
        }
    }

    /// Rests for a simulated time, as a device does that is at work; not at all while the clock waits for its clients.
    pub async fn rest(&self, time: Duration) {
        if let TimeScale::Paced(scale) = self.scale()
            && !time.is_zero()
        {
            tokio::time::sleep(time.div_f64(scale)).await;
        }
    }
}

/// The host time that simulated time `at` takes.
fn host_time(at: SimTime, scale: f64) -> Duration {
    Duration::from_secs_f64(at.as_secs_f64() / scale)
}

#[cfg(test)]
mod tests {
    use rowscan_ports::clock::Stopwatch;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn deadlines_are_absolute_and_scaled() {
        let clock = SimClock::start(TimeScale::Paced(10.0));
        let watch = Stopwatch::start();
        clock.reach(SimTime(20_000_000_000)).await;
        // tokio's timer rounds up to its next millisecond
        assert!(watch.elapsed().abs_diff(Duration::from_secs(2)) <= Duration::from_millis(1));
        assert_eq!(clock.now().0 / 1_000_000_000, 20);
    }

    #[tokio::test(start_paused = true)]
    async fn a_clock_that_was_stopped_stands_whatever_deadline_came_meanwhile() {
        // Which of both is seen first, the deadline or the stop, is left to chance.
        for _ in 0..64 {
            let clock = SimClock::start(TimeScale::Paced(1.0));
            let mut reached = std::pin::pin!(clock.reach(SimTime(20_000_000)));
            let waker = std::task::Waker::noop();
            let mut context = std::task::Context::from_waker(waker);
            assert!(reached.as_mut().poll(&mut context).is_pending());
            tokio::time::advance(Duration::from_millis(19)).await;
            clock.pause(true);
            let stopped = clock.now();
            tokio::time::advance(Duration::from_millis(5)).await;
            assert!(reached.as_mut().poll(&mut context).is_pending());
            assert_eq!(clock.now(), stopped);
            clock.pause(false);
            reached.await;
            assert_eq!(clock.now(), SimTime(20_000_000));
        }
    }

    #[tokio::test(start_paused = true)]
    async fn what_the_host_had_no_time_for_is_not_due_at_once() {
        let clock = SimClock::start(TimeScale::Paced(1.0));
        clock.reach(SimTime(5_000_000_000)).await;
        clock.expect(SimTime(5_020_000_000));
        clock.set_scale(1e6).unwrap();
        tokio::time::advance(Duration::from_millis(300)).await;
        clock.set_scale(1.0).unwrap();
        // 300 000 s have passed, and the scanner has come to second 5.
        assert_eq!(clock.now(), SimTime(65_020_000_000));
        // Nothing is due for an hour: that hour is lived.
        clock.expect(SimTime(3_600_000_000_000));
        tokio::time::advance(Duration::from_secs(1_000)).await;
        clock.pause(true);
        assert_eq!(clock.now().0 / 1_000_000_000, 1065);
    }

    #[tokio::test(start_paused = true)]
    async fn time_that_stands_is_no_later_when_it_goes_on() {
        let clock = std::sync::Arc::new(SimClock::start(TimeScale::Paced(2.0)));
        let second = SimTime(1_000_000_000);
        clock.reach(second).await;
        clock.pause(true);
        let waits = tokio::spawn({
            let clock = std::sync::Arc::clone(&clock);
            async move { clock.reach(SimTime(2 * second.0)).await }
        });
        tokio::time::sleep(Duration::from_secs(60)).await;
        assert!(!waits.is_finished() && clock.now() < SimTime(second.0 + 5_000_000), "{:?}", clock.now());
        assert_eq!(clock.lateness(second), Duration::ZERO);
        clock.set_scale(0.5).unwrap();
        clock.pause(false);
        let watch = Stopwatch::start();
        waits.await.unwrap();
        assert!(watch.elapsed().abs_diff(Duration::from_secs(2)) <= Duration::from_millis(5));
        assert!(clock.set_scale(0.0).is_err());
        let patient = SimClock::start(TimeScale::Max);
        assert_eq!(patient.set_scale(2.0), Err(TimeScaleError::NotPaced));
    }
}
