//! Clocks that programs read.

use libc::{c_int, clockid_t, time_t, timespec, timeval};

use crate::instant::{Clock, timespec_of, timeval_of, write};
use crate::page::page;
use crate::real::real;

#[unsafe(no_mangle)]
unsafe extern "C" fn clock_gettime(clock: clockid_t, time: *mut timespec) -> c_int {
    match page().zip(Clock::of(clock)) {
        Some((page, clock)) => {
            // SAFETY: the caller's.
            unsafe { write(time, timespec_of(clock.now_ns(page))) };
            0
        }
        None => real!(clock_gettime(clock => clockid_t, time => *mut timespec) -> c_int),
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn gettimeofday(time: *mut timeval, zone: *mut libc::c_void) -> c_int {
    match page() {
        Some(page) => {
            // SAFETY: the caller's.
            unsafe { write(time, timeval_of(page.utc_ns())) };
            0
        }
        None => real!(gettimeofday(time => *mut timeval, zone => *mut libc::c_void) -> c_int),
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn time(at: *mut time_t) -> time_t {
    match page() {
        Some(page) => {
            let seconds = timespec_of(page.utc_ns()).tv_sec;
            // SAFETY: the caller's.
            unsafe { write(at, seconds) };
            seconds
        }
        None => real!(time(at => *mut time_t) -> time_t),
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn timespec_get(time: *mut timespec, base: c_int) -> c_int {
    /// `TIME_UTC` of C11.
    const UTC: c_int = 1;
    match page().filter(|_| base == UTC) {
        Some(page) => {
            // SAFETY: the caller's.
            unsafe { write(time, timespec_of(page.utc_ns())) };
            base
        }
        None => real!(timespec_get(time => *mut timespec, base => c_int) -> c_int, else 0),
    }
}
