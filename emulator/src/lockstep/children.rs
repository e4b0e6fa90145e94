//! Simulated time for children that wait by it: their clock follows the timeline, and their timers are on it.
//!
//! Before the drive their clock stands still but for their own timers: each takes as long, by the host, as it was set for, and then their clock
//! shows its instant. So what they wait for in order to start comes to pass, and their clock shows the same in every run, however long the host
//! took. From the first step on it goes with simulated time, without a jump; their time of day then is that of the scene.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_child_clock::{BenchPage, PageError, START_NS, Timer};
use rowscan_ports::clock::{self, Stopwatch};
use rowscan_protocol::time::SimTime;

/// Between two looks at the children's timers before the drive, host time.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// The clock of a rig's children. Clones share it.
#[derive(Clone, Debug)]
pub struct ChildClock(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    page: BenchPage,
    /// Nanoseconds since 1970 at simulated time zero.
    utc_ns: i64,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// What the children's clock is ahead of simulated time, once that runs for them.
    ahead_ns: Option<u64>,
    /// Timers seen before the drive: how long each takes, and since when it is seen.
    seen: Vec<(Timer, Duration, Stopwatch)>,
}

impl ChildClock {
    /// Makes the page at `path`; `utc_s` is the time of day at simulated time zero, in seconds since 1970.
    ///
    /// # Errors
    /// The page cannot be made.
    pub fn create(path: &Path, utc_s: f64) -> Result<Self, PageError> {
        let page = BenchPage::create(path)?;
        let utc_ns = (utc_s * 1e9) as i64;
        page.set_utc_offset(utc_ns.saturating_sub_unsigned(START_NS));
        Ok(Self(Arc::new(Shared { page, utc_ns, state: Mutex::default() })))
    }

    /// Where its page is.
    pub fn path(&self) -> &Path {
        self.0.page.path()
    }

    /// Simulated time comes to `at`, and what acts then is heard. Until the drive has begun it starts to run for the children here.
    pub(crate) fn reach(&self, at: SimTime, begun: bool) {
        let page = &self.0.page;
        let mut state = self.lock();
        match state.ahead_ns.filter(|_| begun) {
            Some(ahead) => page.set(at.0.saturating_add(ahead)),
            None => {
                let now = page.now_ns();
                state.ahead_ns = Some(now.saturating_sub(at.0));
                let utc_ns = self.0.utc_ns.saturating_add_unsigned(at.0);
                page.set_utc_offset(utc_ns.saturating_sub_unsigned(now));
            }
        }
    }

    /// When the first of their timers is due.
    pub(crate) fn next(&self) -> Option<SimTime> {
        let ahead = self.lock().ahead_ns?;
        Some(SimTime(self.0.page.earliest()?.deadline_ns.saturating_sub(ahead)))
    }

    /// Fires the next of their timers that is due at `at`; false if none is.
    pub(crate) fn fire(&self, at: SimTime) -> bool {
        let until = self.lock().ahead_ns.map(|ahead| at.0.saturating_add(ahead));
        until.is_some_and(|until| self.0.page.fire_next(until).is_some())
    }

    /// True while a process is there that waits by this clock.
    pub(crate) fn is_followed(&self) -> bool {
        self.processes().next().is_some()
    }

    /// The processes that wait by it.
    pub(crate) fn processes(&self) -> impl Iterator<Item = u32> {
        self.0.page.processes()
    }

    /// True while a thread of this process waits for a timer that is not due yet.
    pub(super) fn has_timer(&self, process: u32) -> bool {
        self.0.page.waiting().any(|timer| timer.process == process)
    }

    /// A process that has not yet dealt with a timer that was fired.
    pub(super) fn firing(&self) -> Option<u32> {
        self.0.page.firing().map(|timer| timer.process)
    }

    /// Where no simulated time passes, before the drive and behind its end: lets the children's timers take the host's time. Does not end.
    pub async fn follow_host(&self) {
        loop {
            self.pass();
            clock::rest(LOOK_EVERY).await;
        }
    }

    /// Fires the first of their timers if it has taken its time.
    fn pass(&self) {
        let page = &self.0.page;
        let mut state = self.lock();
        let waiting: Vec<Timer> = page.waiting().collect();
        state.seen.retain(|(timer, ..)| waiting.contains(timer));
        for timer in &waiting {
            if state.seen.iter().all(|(seen, ..)| seen != timer) {
                let takes = Duration::from_nanos(timer.deadline_ns.saturating_sub(page.now_ns()));
                state.seen.push((*timer, takes, Stopwatch::start()));
            }
        }
        let first = state.seen.iter().min_by_key(|(timer, ..)| *timer);
        if let Some((timer, ..)) = first.filter(|(_, takes, since)| since.elapsed() >= *takes) {
            page.set(timer.deadline_ns);
            while page.fire_next(timer.deadline_ns).is_some() {}
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use rowscan_child_clock::{ChildPage, in_thread};

    use super::*;

    const MS: u64 = 1_000_000;

    fn clock() -> (tempfile::TempDir, ChildClock, ChildPage) {
        let folder = tempfile::tempdir().unwrap();
        let clock = ChildClock::create(&folder.path().join("page"), 1000.0).unwrap();
        let child = ChildPage::open(clock.path()).unwrap();
        (folder, clock, child)
    }

    #[tokio::test(start_paused = true)]
    async fn before_the_drive_a_timer_takes_the_host_s_time_and_the_clock_shows_its_instant() {
        let (_folder, clock, child) = clock();
        tokio::time::advance(Duration::from_secs(3)).await;
        // What the host took before it was set does not count.
        let wait = child.wait_until(START_NS + 5 * MS, in_thread()).unwrap();
        clock.pass();
        tokio::time::advance(Duration::from_millis(4)).await;
        clock.pass();
        assert_eq!((wait.has_fired(), child.now_ns(), clock.next()), (false, START_NS, None));
        tokio::time::advance(Duration::from_millis(3)).await;
        clock.pass();
        assert_eq!((wait.has_fired(), child.now_ns()), (true, START_NS + 5 * MS));
        drop(wait);
        // The drive: no jump, and the scene's time of day.
        clock.reach(SimTime(20 * MS), false);
        assert_eq!((child.now_ns(), child.utc_ns()), (START_NS + 5 * MS, 1_000_020 * MS));
        clock.reach(SimTime(40 * MS), true);
        assert_eq!((child.now_ns(), child.utc_ns()), (START_NS + 25 * MS, 1_000_040 * MS));
    }

    #[test]
    fn timers_of_one_instant_fire_one_by_one_in_the_order_of_threads() {
        let (_folder, clock, child) = clock();
        clock.reach(SimTime(20 * MS), false);
        std::thread::scope(|scope| {
            let (tell, told) = std::sync::mpsc::channel();
            let (end, ended) = std::sync::mpsc::channel::<()>();
            scope.spawn(move || {
                tell.send(in_thread()).unwrap();
                let _ = ended.recv();
            });
            let later = child.wait_until(START_NS + 10 * MS, told.recv().unwrap()).unwrap();
            let first = child.wait_until(START_NS + 10 * MS, in_thread()).unwrap();
            assert_eq!(clock.next(), Some(SimTime(30 * MS)));
            clock.reach(SimTime(30 * MS), true);
            assert!(!clock.fire(SimTime(30 * MS - 1)) && clock.fire(SimTime(30 * MS)));
            assert!(first.has_fired() && !later.has_fired() && clock.firing().is_some());
            drop(first);
            assert_eq!(clock.firing(), None);
            assert!(clock.fire(SimTime(30 * MS)) && later.has_fired() && !clock.fire(SimTime(30 * MS)));
            drop(end);
        });
    }

    #[test]
    fn a_timer_of_a_thread_that_is_gone_holds_nobody_up() {
        let (_folder, clock, child) = clock();
        clock.reach(SimTime(20 * MS), false);
        let gone = std::thread::spawn(in_thread).join().unwrap();
        // The kernel may still be about to let it go.
        while Path::new(&format!("/proc/self/task/{gone}")).exists() {
            std::thread::yield_now();
        }
        let _kept = child.wait_until(START_NS, gone).unwrap().keep();
        assert!(!clock.fire(SimTime(20 * MS)) && clock.firing().is_none() && clock.next().is_none());
    }
}
