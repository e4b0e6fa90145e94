//! The one place of the emulator that knows the host's clock: everything else runs on simulated time.

#[cfg(target_os = "linux")]
mod system_timer;

use std::collections::VecDeque;
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::task::Poll;
use std::time::{Duration, SystemTime};

use rowscan_ports::Delivery;
use rowscan_protocol::time::SimTime;
use rowscan_recording::WallClock;
use tokio::sync::{Notify, watch};
use tokio::time::{Instant, sleep_until};

/// How simulated time runs against the host's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TimeScale {
    /// So many simulated seconds a host second; deadlines are absolute, a slow client loses scans.
    Paced(f64),
    /// As fast as the clients take it; the simulated clock waits for them and nothing is lost.
    Max,
}

/// Why a time scale was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TimeScaleError {
    /// No scale at all.
    #[error("expected a positive number (1 = real time, 10 = ten times faster) or `max`, found `{0}`")]
    Nonsense(String),
    /// The clock waits for its clients.
    #[error("the clock runs as fast as its clients take what it sends: it has no scale")]
    NotPaced,
}

impl TimeScale {
    /// What happens to data that somebody is too slow for.
    pub fn delivery(self) -> Delivery {
        match self {
            Self::Paced(_) => Delivery::Paced,
            Self::Max => Delivery::Patient,
        }
    }
}

impl FromStr for TimeScale {
    type Err = TimeScaleError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "max" => Ok(Self::Max),
            _ => match text.parse::<f64>() {
                Ok(scale) if scale.is_finite() && (1e-6..=1e6).contains(&scale) => Ok(Self::Paced(scale)),
                _ => Err(TimeScaleError::Nonsense(text.to_owned())),
            },
        }
    }
}

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

/// Simulated time as the host sees it.
#[derive(Debug)]
pub struct SimClock {
    epoch: Instant,
    pace: watch::Sender<Pace>,
    /// The latest instant the mirror reached, ns; what time it is while the clock waits for its clients.
    reached: AtomicU64,
    /// Notified when it gets further.
    moved: Notify,
}

/// How time runs since somebody changed that last.
#[derive(Clone, Copy, Debug)]
struct Pace {
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
enum Due {
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

    fn due(&self, at: SimTime) -> Due {
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
        Self { epoch, pace: watch::Sender::new(pace), reached: AtomicU64::new(0), moved: Notify::new() }
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

    fn change(&self, change: impl FnOnce(&mut Pace)) {
        self.pace.send_modify(|pace| {
            pace.at = self.now_at(pace);
            pace.from = self.epoch.elapsed();
            change(pace);
        });
    }

    /// Waits for the simulated instant `at`: until its absolute host deadline if paced; else it only lets others run, so that no
    /// loop that turns as fast as it can keeps its thread for itself.
    pub async fn reach(&self, at: SimTime) {
        self.waited(at).await;
        self.reached(at);
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

/// The host's time of day for recordings: it runs on evenly, whatever happens to the system's clock after the start.
pub fn wall_clock() -> WallClock {
    let began = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    let epoch = Instant::now();
    WallClock::new(move || (began + epoch.elapsed()).as_nanos() as u64)
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
        let waiter = system.map(|system| system.waiter(clock.epoch.elapsed()));
        Self { waiter, pace: clock.pace.subscribe() }
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

/// Lets every task run that is ready. Unlike tokio's own way it does not ask the system for news first, which costs more than a
/// turn of the mirror does otherwise.
pub(crate) async fn step_aside() {
    let mut stepped = false;
    std::future::poll_fn(|context| {
        if std::mem::replace(&mut stepped, true) {
            return Poll::Ready(());
        }
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await;
}

/// Keeps the thread for a time that is too short for timers: letting others run would cost more.
pub(crate) fn spin(time: Duration) {
    let begun = std::time::Instant::now();
    while begun.elapsed() < time {
        std::hint::spin_loop();
    }
}

/// A pause between two looks at something that nobody tells of, `waited` so far: short at first, so that a fast peer costs little; then a
/// millisecond, so that a slow one gets the processor.
pub(crate) async fn look_again(waited: Duration) {
    // The runtime's timer takes up to two milliseconds for one: a quarter of what was waited already.
    const AT_ONCE: Duration = Duration::from_millis(8);
    if waited < AT_ONCE {
        tokio::task::yield_now().await;
    } else {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

/// The host time that simulated time `at` takes.
fn host_time(at: SimTime, scale: f64) -> Duration {
    Duration::from_secs_f64(at.as_secs_f64() / scale)
}

/// A short rest before trying again what the system just refused.
pub(crate) async fn breathe() {
    tokio::time::sleep(Duration::from_millis(50)).await;
}

/// How many hand-overs a [`Latency`] remembers; more than any client's queue holds.
const REMEMBERED: usize = 4096;

/// Host time from handing a telegram to its socket queue until someone says it has been used.
#[derive(Debug, Default)]
pub struct Latency {
    sent: Mutex<VecDeque<(u16, Instant)>>,
    measured: Mutex<Vec<Duration>>,
}

impl Latency {
    /// The telegram with this counter is on its way.
    pub fn sent(&self, telegram_counter: u16) {
        let mut sent = self.sent.lock().unwrap_or_else(PoisonError::into_inner);
        if sent.len() == REMEMBERED {
            sent.pop_front();
        }
        sent.push_back((telegram_counter, Instant::now()));
    }

    /// The telegram with this counter has been used.
    pub fn used(&self, telegram_counter: u16) {
        let now = Instant::now();
        let mut sent = self.sent.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some((counter, at)) = sent.pop_front() {
            if counter == telegram_counter {
                self.measured.lock().unwrap_or_else(PoisonError::into_inner).push(now - at);
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
pub struct Lateness(std::sync::Arc<Mutex<Vec<Duration>>>);

impl Lateness {
    /// Watches from now on, every `period`, in a task of `tasks`. It remembers an hour and more.
    pub fn watch(period: Duration, tasks: &mut tokio::task::JoinSet<()>) -> Self {
        let lateness = Self(std::sync::Arc::default());
        let kept = lateness.clone();
        tasks.spawn(async move {
            let mut due = Instant::now();
            loop {
                due += period;
                sleep_until(due).await;
                let mut measured = kept.0.lock().unwrap_or_else(PoisonError::into_inner);
                if measured.len() < 1_000_000 {
                    measured.push(due.elapsed());
                }
            }
        });
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

/// Host time since `self` was made; for telling the user how long something took.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch(Instant);

impl Stopwatch {
    /// Starts at zero.
    pub fn start() -> Self {
        Self(Instant::now())
    }

    /// Time since the start.
    pub fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_scale_is_a_positive_number_or_max() {
        assert_eq!("max".parse(), Ok(TimeScale::Max));
        assert_eq!("0.5".parse(), Ok(TimeScale::Paced(0.5)));
        for nonsense in ["0", "-1", "nan", "inf", "fast", ""] {
            let message = nonsense.parse::<TimeScale>().expect_err(nonsense).to_string();
            assert!(message.contains(&format!("`{nonsense}`")), "{message}");
        }
    }

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
