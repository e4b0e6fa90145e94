//! Receive time-outs of sockets as options: kept here, so that the system waits without an end.

use libc::{c_int, c_void, socklen_t, timeval};

use crate::descriptors::{receive_ns, set_receive_ns};
use crate::errno;
use crate::instant::{ns_of_timeval, timeval_of};
use crate::page::page;
use crate::real::real;

const TIMEVAL: socklen_t = size_of::<timeval>() as socklen_t;

#[unsafe(no_mangle)]
unsafe extern "C" fn setsockopt(
    socket: c_int,
    level: c_int,
    option: c_int,
    value: *const c_void,
    size: socklen_t,
) -> c_int {
    let call = |value: *const c_void, size| {
        real!(setsockopt(
            socket => c_int,
            level => c_int,
            option => c_int,
            value => *const c_void,
            size => socklen_t,
        ) -> c_int)
    };
    let is_timeout = (level, option) == (libc::SOL_SOCKET, libc::SO_RCVTIMEO);
    if page().is_none() || !is_timeout || value.is_null() || size < TIMEVAL {
        return call(value, size);
    }
    // SAFETY: the caller's, and large enough.
    let time = unsafe { value.cast::<timeval>().read_unaligned() };
    // The system itself says what is no socket, and waits without an end.
    let none = timeval_of(0);
    let set = call((&raw const none).cast(), TIMEVAL);
    if set != 0 {
        return set;
    }
    match ns_of_timeval(&time) {
        Some(ns) if set_receive_ns(socket, ns) => 0,
        Some(_) => call(value, size),
        None => {
            errno::set(libc::EDOM);
            -1
        }
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn getsockopt(
    socket: c_int,
    level: c_int,
    option: c_int,
    value: *mut c_void,
    size: *mut socklen_t,
) -> c_int {
    let found = real!(getsockopt(
        socket => c_int,
        level => c_int,
        option => c_int,
        value => *mut c_void,
        size => *mut socklen_t,
    ) -> c_int);
    let is_timeout = (level, option) == (libc::SOL_SOCKET, libc::SO_RCVTIMEO);
    if let Some(ns) = receive_ns(socket).filter(|_| found == 0 && is_timeout) {
        // SAFETY: the system has just written as much there.
        unsafe {
            if *size >= TIMEVAL {
                value.cast::<timeval>().write_unaligned(timeval_of(ns));
            }
        }
    }
    found
}
