//! Time-outs of condition variables, semaphores and mutexes.

use std::collections::BTreeSet;

use libc::{c_int, clockid_t, pthread_cond_t, pthread_condattr_t, pthread_mutex_t, sem_t, timespec};
use rowscan_child_clock::{ChildPage, in_thread};

use crate::errno;
use crate::instant::{Clock, ns, read, timespec_of};
use crate::keeper::{Poke, Wait};
use crate::lock::Lock;
use crate::page::page;
use crate::real::real;

/// Condition variables whose time-outs are by the monotonic clock: nothing but their attributes told that.
static MONOTONIC: Lock<BTreeSet<usize>> = Lock::new(BTreeSet::new());

/// How long a thread waits for a semaphore or a mutex, host time, before it looks at simulated time again: nothing else ends that wait. 0.5 ms.
const SLICE_NS: u64 = 500_000;

/// In a forked child nobody holds it.
pub(crate) fn forked() {
    MONOTONIC.open();
}

/// The deadline of an instant of `clock`; an error where it is no valid time.
///
/// # Safety
/// `at` is null or valid.
unsafe fn deadline(page: &ChildPage, clock: Clock, at: *const timespec) -> Result<u64, c_int> {
    // SAFETY: the caller's promise.
    let at = unsafe { read(at) }.ok_or(libc::EINVAL)?;
    // An instant before 1970 has passed.
    if at.tv_sec < 0 {
        return Ok(0);
    }
    Ok(clock.deadline(page, ns(&at).ok_or(libc::EINVAL)?))
}

/// Waits for a condition variable; none where the C library must.
fn wait_for(
    page: &'static ChildPage,
    (condition, mutex): (*mut pthread_cond_t, *mut pthread_mutex_t),
    deadline: Result<u64, c_int>,
) -> Option<c_int> {
    let deadline = match deadline {
        Ok(deadline) if deadline > page.now_ns() => deadline,
        Ok(_) => return Some(passed(condition, mutex)),
        Err(code) => return Some(code),
    };
    let wait = Wait::begin(page, deadline, Poke::Condition(condition))?;
    let waited = real!(pthread_cond_wait(
        condition => *mut pthread_cond_t,
        mutex => *mut pthread_mutex_t,
    ) -> c_int, else libc::ENOSYS);
    match waited {
        0 if wait.has_fired() => Some(libc::ETIMEDOUT),
        code => Some(code),
    }
}

/// A wait whose time has passed still lets the mutex go for a moment: others may wait for it.
fn passed(condition: *mut pthread_cond_t, mutex: *mut pthread_mutex_t) -> c_int {
    let long_ago = timespec_of(0);
    real!(pthread_cond_timedwait(
        condition => *mut pthread_cond_t,
        mutex => *mut pthread_mutex_t,
        &raw const long_ago => *const timespec,
    ) -> c_int, else libc::ENOSYS)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn pthread_cond_init(
    condition: *mut pthread_cond_t,
    attributes: *const pthread_condattr_t,
) -> c_int {
    let mut clock = libc::CLOCK_REALTIME;
    if !attributes.is_null() {
        // SAFETY: the caller's.
        unsafe { libc::pthread_condattr_getclock(attributes, &raw mut clock) };
    }
    let mut monotonic = MONOTONIC.lock();
    match clock {
        libc::CLOCK_MONOTONIC => monotonic.insert(condition as usize),
        _ => monotonic.remove(&(condition as usize)),
    };
    drop(monotonic);
    real!(pthread_cond_init(
        condition => *mut pthread_cond_t,
        attributes => *const pthread_condattr_t,
    ) -> c_int, else libc::ENOSYS)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn pthread_cond_destroy(condition: *mut pthread_cond_t) -> c_int {
    MONOTONIC.lock().remove(&(condition as usize));
    real!(pthread_cond_destroy(condition => *mut pthread_cond_t) -> c_int, else libc::ENOSYS)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn pthread_cond_timedwait(
    condition: *mut pthread_cond_t,
    mutex: *mut pthread_mutex_t,
    at: *const timespec,
) -> c_int {
    let waited = page().and_then(|page| {
        let is_monotonic = MONOTONIC.lock().contains(&(condition as usize));
        let clock = if is_monotonic { Clock::Monotonic } else { Clock::Utc };
        // SAFETY: the caller's.
        wait_for(page, (condition, mutex), unsafe { deadline(page, clock, at) })
    });
    waited.unwrap_or_else(|| {
        real!(pthread_cond_timedwait(
            condition => *mut pthread_cond_t,
            mutex => *mut pthread_mutex_t,
            at => *const timespec,
        ) -> c_int, else libc::ENOSYS)
    })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn pthread_cond_clockwait(
    condition: *mut pthread_cond_t,
    mutex: *mut pthread_mutex_t,
    clock: clockid_t,
    at: *const timespec,
) -> c_int {
    let waited = page().zip(Clock::of(clock)).and_then(|(page, clock)| {
        // SAFETY: the caller's.
        wait_for(page, (condition, mutex), unsafe { deadline(page, clock, at) })
    });
    waited.unwrap_or_else(|| {
        real!(pthread_cond_clockwait(
            condition => *mut pthread_cond_t,
            mutex => *mut pthread_mutex_t,
            clock => clockid_t,
            at => *const timespec,
        ) -> c_int, else libc::ENOSYS)
    })
}

/// Tries again and again, a short time each, until it is had or simulated time has come to the deadline; none where the page is full. `attempt` gets
/// a host's instant of `CLOCK_REALTIME` and says its code.
fn in_slices(
    page: &'static ChildPage,
    deadline: Result<u64, c_int>,
    attempt: impl Fn(*const timespec) -> c_int,
) -> Option<c_int> {
    let deadline = match deadline {
        Ok(deadline) => deadline,
        Err(code) => return Some(code),
    };
    let try_until = |ns| attempt(&raw const ns);
    // What is free is had, whatever the time is.
    let had = try_until(timespec_of(0));
    if had != libc::ETIMEDOUT || deadline <= page.now_ns() {
        return Some(had);
    }
    let waiting = page.wait_until(deadline, in_thread())?;
    loop {
        let has_fired = waiting.has_fired();
        let host = rustix::time::clock_gettime(rustix::time::ClockId::Realtime);
        let host = timespec { tv_sec: host.tv_sec, tv_nsec: host.tv_nsec };
        let slice = if has_fired { 0 } else { SLICE_NS };
        let had = try_until(timespec_of(ns(&host)?.saturating_add(slice)));
        if had != libc::ETIMEDOUT || has_fired {
            return Some(had);
        }
    }
}

/// Waits for a semaphore: 0, or -1 with `errno`.
fn wait_for_semaphore(
    page: &'static ChildPage,
    semaphore: *mut sem_t,
    deadline: Result<u64, c_int>,
) -> Option<c_int> {
    let code = in_slices(page, deadline, |until| {
        let had = real!(sem_timedwait(semaphore => *mut sem_t, until => *const timespec) -> c_int);
        if had == 0 { 0 } else { errno::get() }
    })?;
    if code == 0 {
        return Some(0);
    }
    errno::set(code);
    Some(-1)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn sem_timedwait(semaphore: *mut sem_t, at: *const timespec) -> c_int {
    let waited = page().and_then(|page| {
        // SAFETY: the caller's.
        wait_for_semaphore(page, semaphore, unsafe { deadline(page, Clock::Utc, at) })
    });
    waited.unwrap_or_else(|| real!(sem_timedwait(semaphore => *mut sem_t, at => *const timespec) -> c_int))
}

#[unsafe(no_mangle)]
unsafe extern "C" fn sem_clockwait(semaphore: *mut sem_t, clock: clockid_t, at: *const timespec) -> c_int {
    let waited = page().zip(Clock::of(clock)).and_then(|(page, clock)| {
        // SAFETY: the caller's.
        wait_for_semaphore(page, semaphore, unsafe { deadline(page, clock, at) })
    });
    waited.unwrap_or_else(|| {
        real!(sem_clockwait(
            semaphore => *mut sem_t,
            clock => clockid_t,
            at => *const timespec,
        ) -> c_int)
    })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn pthread_mutex_timedlock(mutex: *mut pthread_mutex_t, at: *const timespec) -> c_int {
    let call = |until: *const timespec| {
        real!(pthread_mutex_timedlock(
            mutex => *mut pthread_mutex_t,
            until => *const timespec,
        ) -> c_int, else libc::ENOSYS)
    };
    // SAFETY: the caller's.
    let waited = page().and_then(|page| in_slices(page, unsafe { deadline(page, Clock::Utc, at) }, call));
    waited.unwrap_or_else(|| call(at))
}
