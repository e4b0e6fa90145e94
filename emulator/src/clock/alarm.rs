//! The system's own timer: it rings within tens of microseconds where the runtime's wheel turns in milliseconds.
//!
//! Setting a timer costs a microsecond, and several on a virtual machine. So one timer serves any number of waiting tasks: they
//! stand in a queue by their deadlines, one task (the ringer) calls whoever's has come, and the timer is set for the first that
//! has not. Where the first is nearer than setting the timer takes, the ringer lets others run and looks again.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

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

/// One timer for whoever waits on this thread or others. Clones share it; the last one takes the ringer with it.
#[derive(Clone, Debug)]
pub(super) struct Alarm {
    bell: Arc<Bell>,
    _ringer: Arc<JoinSet<()>>,
}

/// One task's way to wait for an alarm.
#[derive(Debug)]
pub(super) struct Waiter {
    alarm: Alarm,
    /// Where this task's instants count from, on the monotonic clock.
    epoch: Duration,
    called: Arc<Notify>,
}

#[derive(Debug)]
struct Bell {
    timer: AsyncFd<OwnedFd>,
    queue: Mutex<Queue>,
}

/// Who waits. All instants are of the monotonic clock.
#[derive(Debug)]
struct Queue {
    calls: BinaryHeap<Reverse<Call>>,
    /// Calls so far: of equal deadlines the first come is the first served.
    number: u64,
    /// Nobody need set the timer for what comes later: it will ring, or the ringer is awake.
    covered_from: Duration,
    /// The timer has failed; nobody is called any more.
    failed: bool,
}

#[derive(Debug)]
struct Call {
    at: Duration,
    number: u64,
    called: Arc<Notify>,
}

impl Alarm {
    /// An alarm whose ringer runs in the current runtime.
    pub(super) fn new() -> io::Result<Self> {
        let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
        let timer = timerfd_create(TimerfdClockId::Monotonic, flags)?;
        #[expect(
            deprecated,
            reason = "its successor is unsafe, for types that may close their descriptor; an OwnedFd does not"
        )]
        let timer = AsyncFd::with_interest(timer, Interest::READABLE)?;
        let queue =
            Queue { calls: BinaryHeap::new(), number: 0, covered_from: Duration::ZERO, failed: false };
        let bell = Arc::new(Bell { timer, queue: Mutex::new(queue) });
        let mut ringer = JoinSet::new();
        ringer.spawn(ring(Arc::clone(&bell)));
        Ok(Self { bell, _ringer: Arc::new(ringer) })
    }

    /// For one task whose instants count from `elapsed` ago.
    pub(super) fn waiter(&self, elapsed: Duration) -> Waiter {
        let epoch = monotonic().saturating_sub(elapsed);
        Waiter { alarm: self.clone(), epoch, called: Arc::default() }
    }
}

impl Waiter {
    /// Returns at `since_epoch`, never before; false if the timer has failed. Where that has passed it only lets others run.
    pub(super) async fn reach(&mut self, since_epoch: Duration) -> bool {
        let at = self.epoch.saturating_add(since_epoch);
        if monotonic() >= at {
            super::step_aside().await;
            return true;
        }
        self.alarm.bell.wait(at, &self.called);
        loop {
            self.called.notified().await;
            // A call from a wait that was given up may have come late.
            if monotonic() >= at {
                return true;
            }
            if self.alarm.bell.lock().failed {
                return false;
            }
        }
    }
}

impl Bell {
    /// Has `called` notified at `at`.
    fn wait(&self, at: Duration, called: &Arc<Notify>) {
        let mut queue = self.lock();
        let number = queue.number;
        queue.number += 1;
        queue.calls.push(Reverse(Call { at, number, called: Arc::clone(called) }));
        if at < queue.covered_from {
            queue.covered_from = at;
            self.set(at, &mut queue);
        }
        if queue.failed {
            called.notify_one();
        }
    }

    /// Calls whoever's time has come. True if the next is so near that the timer is not set for it.
    fn call_due(&self) -> bool {
        let now = monotonic();
        let mut queue = self.lock();
        while let Some(Reverse(call)) = queue.calls.peek() {
            let at = call.at;
            if at > now + NEAR {
                queue.covered_from = at;
                self.set(at, &mut queue);
                return false;
            }
            if at > now {
                queue.covered_from = Duration::ZERO;
                return true;
            }
            if let Some(Reverse(call)) = queue.calls.pop() {
                call.called.notify_one();
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
            queue.calls.drain().for_each(|Reverse(call)| call.called.notify_one());
        }
    }

    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Rings for as long as the alarm is there.
async fn ring(bell: Arc<Bell>) {
    loop {
        while bell.call_due() {
            tokio::task::yield_now().await;
        }
        // Setting the timer anew forgets that it rang, and the next ring comes as an edge: it need not be read.
        match bell.timer.readable().await {
            Ok(mut rung) => rung.clear_ready(),
            // The runtime is shutting down.
            Err(_) => return,
        }
    }
}

fn monotonic() -> Duration {
    let now = clock_gettime(ClockId::Monotonic);
    Duration::new(now.tv_sec.max(0) as u64, now.tv_nsec.max(0) as u32)
}

impl Ord for Call {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (self.at, self.number).cmp(&(other.at, other.number))
    }
}

impl PartialOrd for Call {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Call {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Call {}
