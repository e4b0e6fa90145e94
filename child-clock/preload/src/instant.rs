//! Times as C has them, and as instants of the page.

use libc::{timespec, timeval};
use rowscan_child_clock::ChildPage;

const SECOND: u64 = 1_000_000_000;

/// Nanoseconds of a length of time; none if it is no valid one.
pub(crate) fn ns(time: &timespec) -> Option<u64> {
    let fraction = u64::try_from(time.tv_nsec).ok().filter(|ns| *ns < SECOND)?;
    Some(u64::try_from(time.tv_sec).ok()?.saturating_mul(SECOND).saturating_add(fraction))
}

pub(crate) fn ns_of_timeval(time: &timeval) -> Option<u64> {
    let fraction = u64::try_from(time.tv_usec).ok().filter(|us| *us < 1_000_000)?;
    Some(u64::try_from(time.tv_sec).ok()?.saturating_mul(SECOND).saturating_add(fraction * 1000))
}

pub(crate) fn timespec_of(ns: u64) -> timespec {
    // Both fit: the second one is below 10⁹, the first below 2³⁵.
    timespec { tv_sec: (ns / SECOND) as i64, tv_nsec: (ns % SECOND) as i64 }
}

pub(crate) fn timeval_of(ns: u64) -> timeval {
    timeval { tv_sec: (ns / SECOND) as i64, tv_usec: (ns % SECOND / 1000) as i64 }
}

/// A clock of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Clock {
    Monotonic,
    Utc,
}

impl Clock {
    /// The page's clock for a number of the system's; none for processor time and what else stays the host's.
    pub(crate) fn of(number: libc::clockid_t) -> Option<Self> {
        match number {
            libc::CLOCK_MONOTONIC
            | libc::CLOCK_MONOTONIC_RAW
            | libc::CLOCK_MONOTONIC_COARSE
            | libc::CLOCK_BOOTTIME
            | libc::CLOCK_BOOTTIME_ALARM => Some(Self::Monotonic),
            libc::CLOCK_REALTIME
            | libc::CLOCK_REALTIME_COARSE
            | libc::CLOCK_REALTIME_ALARM
            | libc::CLOCK_TAI => Some(Self::Utc),
            _ => None,
        }
    }

    pub(crate) fn now_ns(self, page: &ChildPage) -> u64 {
        match self {
            Self::Monotonic => page.now_ns(),
            Self::Utc => page.utc_ns(),
        }
    }

    /// The instant of the page's monotonic clock at which this clock shows `at_ns`.
    pub(crate) fn deadline(self, page: &ChildPage, at_ns: u64) -> u64 {
        match self {
            Self::Monotonic => at_ns,
            Self::Utc => page.now_ns().saturating_add(at_ns.saturating_sub(page.utc_ns())),
        }
    }
}

/// The instant that a relative time-out ends at.
pub(crate) fn after(page: &ChildPage, ns: u64) -> u64 {
    page.now_ns().saturating_add(ns)
}

/// A timespec of the caller's; none where the pointer is null.
///
/// # Safety
/// Null, or valid for reads.
pub(crate) unsafe fn read<T: Copy>(at: *const T) -> Option<T> {
    // SAFETY: as the caller promises.
    if at.is_null() { None } else { Some(unsafe { at.read() }) }
}

/// Writes to where the caller wants it, if anywhere.
///
/// # Safety
/// Null, or valid for writes.
pub(crate) unsafe fn write<T>(at: *mut T, value: T) {
    if !at.is_null() {
        // SAFETY: as the caller promises.
        unsafe { at.write(value) };
    }
}
