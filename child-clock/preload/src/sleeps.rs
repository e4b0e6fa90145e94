//! Sleeps.

use libc::{c_int, c_uint, clockid_t, timespec};
use rowscan_child_clock::{ChildPage, in_thread};

use crate::errno;
use crate::instant::{Clock, after, ns, read, timespec_of, write};
use crate::page::page;
use crate::real::real;

/// Sleeps until the page's monotonic clock shows `deadline_ns`; what is left if a signal came first. None if the page is full.
fn sleep_until(page: &ChildPage, deadline_ns: u64) -> Option<Result<(), u64>> {
    if deadline_ns <= page.now_ns() {
        return Some(Ok(()));
    }
    let waiting = page.wait_until(deadline_ns, in_thread())?;
    match waiting.sleep() {
        true => Some(Ok(())),
        false => Some(Err(deadline_ns.saturating_sub(page.now_ns()))),
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn clock_nanosleep(
    clock: clockid_t,
    flags: c_int,
    request: *const timespec,
    rest: *mut timespec,
) -> c_int {
    let slept = || {
        let (page, clock) = page().zip(Clock::of(clock))?;
        // SAFETY: the caller's.
        let time = ns(&unsafe { read(request) }?)?;
        let is_absolute = flags & libc::TIMER_ABSTIME != 0;
        let deadline = if is_absolute { clock.deadline(page, time) } else { after(page, time) };
        let slept = sleep_until(page, deadline)?;
        Some(slept.map_err(|left| (left, is_absolute)))
    };
    match slept() {
        Some(Ok(())) => 0,
        Some(Err((left, is_absolute))) => {
            if !is_absolute {
                // SAFETY: the caller's.
                unsafe { write(rest, timespec_of(left)) };
            }
            libc::EINTR
        }
        None => real!(clock_nanosleep(
            clock => clockid_t,
            flags => c_int,
            request => *const timespec,
            rest => *mut timespec,
        ) -> c_int, else libc::ENOSYS),
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn nanosleep(request: *const timespec, rest: *mut timespec) -> c_int {
    if page().is_none() {
        return real!(nanosleep(request => *const timespec, rest => *mut timespec) -> c_int);
    }
    // SAFETY: the caller's.
    match unsafe { clock_nanosleep(libc::CLOCK_MONOTONIC, 0, request, rest) } {
        0 => 0,
        code => {
            errno::set(code);
            -1
        }
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn usleep(us: c_uint) -> c_int {
    let request = timespec_of(u64::from(us) * 1000);
    // SAFETY: valid for the call.
    unsafe { nanosleep(&raw const request, std::ptr::null_mut()) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn sleep(seconds: c_uint) -> c_uint {
    let request = timespec_of(u64::from(seconds) * 1_000_000_000);
    let mut rest = timespec_of(0);
    // SAFETY: valid for the call.
    match unsafe { nanosleep(&raw const request, &raw mut rest) } {
        0 => 0,
        // As the C library does: to the nearest second.
        _ => c_uint::try_from(rest.tv_sec + i64::from(rest.tv_nsec >= 500_000_000)).unwrap_or(seconds),
    }
}
