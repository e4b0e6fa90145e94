//! The system's own timer: it rings within tens of microseconds where the runtime's wheel turns in milliseconds.

use std::io;
use std::os::fd::OwnedFd;
use std::time::Duration;

use rustix::io::Errno;
use rustix::time::{
    ClockId, Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, clock_gettime,
    timerfd_create, timerfd_settime,
};
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

/// A timerfd, set to absolute instants of the monotonic clock.
#[derive(Debug)]
pub(super) struct Alarm {
    /// Of the monotonic clock.
    epoch: Duration,
    timer: AsyncFd<OwnedFd>,
}

impl Alarm {
    /// An alarm whose instants count from `elapsed` ago.
    pub(super) fn new(elapsed: Duration) -> io::Result<Self> {
        let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
        let timer = timerfd_create(TimerfdClockId::Monotonic, flags)?;
        #[expect(
            deprecated,
            reason = "its successor is unsafe, for types that may close their descriptor; an OwnedFd does not"
        )]
        let timer = AsyncFd::with_interest(timer, Interest::READABLE)?;
        let now = clock_gettime(ClockId::Monotonic);
        let now = Duration::new(now.tv_sec.max(0) as u64, now.tv_nsec.max(0) as u32);
        Ok(Self { epoch: now.saturating_sub(elapsed), timer })
    }

    /// Returns at `since_epoch`; at once if that has passed.
    pub(super) async fn reach(&mut self, since_epoch: Duration) -> io::Result<()> {
        let at = self.epoch.saturating_add(since_epoch);
        let it_value = Timespec {
            tv_sec: i64::try_from(at.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: at.subsec_nanos().into(),
        };
        let until = Itimerspec { it_interval: Timespec::default(), it_value };
        timerfd_settime(&self.timer, TimerfdTimerFlags::ABSTIME, &until)?;
        let mut expirations = [0; 8];
        loop {
            let mut ready = self.timer.readable().await?;
            match rustix::io::read(&self.timer, &mut expirations) {
                Ok(_) => return Ok(()),
                Err(Errno::AGAIN) => ready.clear_ready(),
                Err(errno) => return Err(errno.into()),
            }
        }
    }
}
