//! The system's own timer: it fires within tens of microseconds where the runtime's wheel turns in milliseconds.
//!
//! Setting a timer costs a microsecond, and several on a virtual machine. So one timer serves any number of waiting tasks: they
//! queue by their deadlines, one task notifies everyone whose deadline has passed and sets the timer for the first that
//! has not. Where the first is nearer than setting the timer takes, that task lets others run and looks again.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_ports::task;
use rustix::time::{
    ClockId, Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, clock_gettime,
    timerfd_create, timerfd_settime,
};
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;
use tokio::sync::Notify;
use tokio::task::JoinSet;

/// A deadline nearer than this is not worth setting the timer for.
const NEAR: Duration = Duration::from_micros(20);

/// One timer for whoever waits on this thread or others. Clones share it; dropping the last one ends its task.
#[derive(Clone, Debug)]
pub(super) struct SystemTimer {
    shared: Arc<Shared>,
    _task: Arc<JoinSet<()>>,
}

/// One task's way to wait for the timer.
#[derive(Debug)]
pub(super) struct Waiter {
    timer: SystemTimer,
    /// Where this task's instants count from, on the monotonic clock.
    epoch: Duration,
    passed: Arc<Notify>,
}

#[derive(Debug)]
struct Shared {
    timer: AsyncFd<OwnedFd>,
    queue: Mutex<Queue>,
}

/// Who waits. All instants are of the monotonic clock.
#[derive(Debug)]
struct Queue {
    deadlines: BinaryHeap<Reverse<Deadline>>,
    /// Deadlines so far: of equal deadlines the first come is the first served.
    number: u64,
    /// Nobody need set the timer for what comes later: it will fire, or the timer's task is awake.
    covered_from: Duration,
    /// The timer has failed; nobody is notified any more.
    failed: bool,
}

#[derive(Debug)]
struct Deadline {
    at: Duration,
    number: u64,
    passed: Arc<Notify>,
}

impl SystemTimer {
    /// A timer whose task runs in the current runtime.
    pub(super) fn new() -> io::Result<Self> {
        let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
        let timer = timerfd_create(TimerfdClockId::Monotonic, flags)?;
        #[expect(
            deprecated,
            reason = "its successor is unsafe, for types that may close their descriptor; an OwnedFd does not"
        )]
        let timer = AsyncFd::with_interest(timer, Interest::READABLE)?;
        let queue =
            Queue { deadlines: BinaryHeap::new(), number: 0, covered_from: Duration::ZERO, failed: false };
        let shared = Arc::new(Shared { timer, queue: Mutex::new(queue) });
        let mut tasks = JoinSet::new();
        tasks.spawn(task(serve(Arc::clone(&shared))));
        Ok(Self { shared, _task: Arc::new(tasks) })
    }

    /// For one task whose instants count from `elapsed` ago.
    pub(super) fn waiter(&self, elapsed: Duration) -> Waiter {
        let epoch = monotonic().saturating_sub(elapsed);
        Waiter { timer: self.clone(), epoch, passed: Arc::default() }
    }
}

impl Waiter {
    /// Returns at `since_epoch`, never before; false if the timer has failed. Where that has passed it only lets others run.
    pub(super) async fn reach(&mut self, since_epoch: Duration) -> bool {
        let at = self.epoch.saturating_add(since_epoch);
        if monotonic() >= at {
            super::yielding::yield_once().await;
            return true;
        }
        self.timer.shared.wait(at, &self.passed);
        loop {
            self.passed.notified().await;
            // A deadline from a wait that was given up may have come late.
            if monotonic() >= at {
                return true;
            }
            if self.timer.shared.lock().failed {
                return false;
            }
        }
    }
}

impl Shared {
    /// Has `passed` notified at `at`.
    fn wait(&self, at: Duration, passed: &Arc<Notify>) {
        let mut queue = self.lock();
        let number = queue.number;
        queue.number += 1;
        queue.deadlines.push(Reverse(Deadline { at, number, passed: Arc::clone(passed) }));
        if at < queue.covered_from {
            queue.covered_from = at;
            self.set(at, &mut queue);
        }
        if queue.failed {
            passed.notify_one();
        }
    }

    /// Calls whoever's time has come. True if the next is so near that the timer is not set for it.
    fn notify_due(&self) -> bool {
        let now = monotonic();
        let mut queue = self.lock();
        while let Some(Reverse(deadline)) = queue.deadlines.peek() {
            let at = deadline.at;
            if at > now + NEAR {
                queue.covered_from = at;
                self.set(at, &mut queue);
                return false;
            }
            if at > now {
                queue.covered_from = Duration::ZERO;
                return true;
            }
            if let Some(Reverse(deadline)) = queue.deadlines.pop() {
                deadline.passed.notify_one();
            }
        }
        queue.covered_from = Duration::MAX;
        false
    }

    fn set(&self, at: Duration, queue: &mut Queue) {
        let it_value = Timespec {
            tv_sec: i64::try_from(at.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: at.subsec_nanos().into(),
        };
        let until = Itimerspec { it_interval: Timespec::default(), it_value };
        if let Err(cause) = timerfd_settime(&self.timer, TimerfdTimerFlags::ABSTIME, &until) {
            tracing::warn!(%cause, "the system's timer fails; the runtime's takes over");
            queue.failed = true;
            queue.deadlines.drain().for_each(|Reverse(deadline)| deadline.passed.notify_one());
        }
    }

    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Serves the waiters for as long as the timer exists.
async fn serve(shared: Arc<Shared>) {
    loop {
        while shared.notify_due() {
            tokio::task::yield_now().await;
        }
        // Setting the timer again clears its expiry, and the next expiry comes as an edge: it need not be read.
        match shared.timer.readable().await {
            Ok(mut fired) => fired.clear_ready(),
            // The runtime is shutting down.
            Err(_) => return,
        }
    }
}

fn monotonic() -> Duration {
    let now = clock_gettime(ClockId::Monotonic);
    Duration::new(now.tv_sec.max(0) as u64, now.tv_nsec.max(0) as u32)
}

impl Ord for Deadline {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.at, self.number).cmp(&(other.at, other.number))
    }
}

impl PartialOrd for Deadline {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Deadline {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Deadline {}
