//! `epoll_wait` and its kin: a wait for the epoll descriptor itself, which is ready when one of its own is.

use libc::{c_int, epoll_event, pollfd, sigset_t, timespec};

use crate::instant::{after, ns, read};
use crate::page::page;
use crate::polls::wait_until;
use crate::real::real;

/// Waits until the epoll descriptor is ready, then `take`s; none where the C library must wait.
fn timed(
    epoll: c_int,
    timeout_ns: Option<u64>,
    mask: *const sigset_t,
    take: impl Fn() -> c_int,
) -> Option<c_int> {
    let page = page()?;
    let deadline = after(page, timeout_ns.filter(|ns| *ns > 0)?);
    loop {
        let mut asked = [pollfd { fd: epoll, events: libc::POLLIN, revents: 0 }];
        let waited = wait_until(page, &mut asked, deadline, mask)?;
        if waited < 0 {
            return Some(waited);
        }
        let taken = take();
        // Another thread may have taken what was there.
        if taken != 0 || waited == 0 {
            return Some(taken);
        }
    }
}

fn of_ms(timeout_ms: c_int) -> Option<u64> {
    u64::try_from(timeout_ms).ok().map(|ms| ms * 1_000_000)
}

fn call(epoll: c_int, events: *mut epoll_event, most: c_int, timeout_ms: c_int) -> c_int {
    real!(epoll_wait(
        epoll => c_int,
        events => *mut epoll_event,
        most => c_int,
        timeout_ms => c_int,
    ) -> c_int)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn epoll_wait(
    epoll: c_int,
    events: *mut epoll_event,
    most: c_int,
    timeout_ms: c_int,
) -> c_int {
    timed(epoll, of_ms(timeout_ms), std::ptr::null(), || call(epoll, events, most, 0))
        .unwrap_or_else(|| call(epoll, events, most, timeout_ms))
}

#[unsafe(no_mangle)]
unsafe extern "C" fn epoll_pwait(
    epoll: c_int,
    events: *mut epoll_event,
    most: c_int,
    timeout_ms: c_int,
    mask: *const sigset_t,
) -> c_int {
    timed(epoll, of_ms(timeout_ms), mask, || call(epoll, events, most, 0)).unwrap_or_else(|| {
        real!(epoll_pwait(
            epoll => c_int,
            events => *mut epoll_event,
            most => c_int,
            timeout_ms => c_int,
            mask => *const sigset_t,
        ) -> c_int)
    })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn epoll_pwait2(
    epoll: c_int,
    events: *mut epoll_event,
    most: c_int,
    timeout: *const timespec,
    mask: *const sigset_t,
) -> c_int {
    // SAFETY: the caller's.
    let ns = unsafe { read(timeout) }.and_then(|timeout| ns(&timeout));
    timed(epoll, ns, mask, || call(epoll, events, most, 0)).unwrap_or_else(|| {
        real!(epoll_pwait2(
            epoll => c_int,
            events => *mut epoll_event,
            most => c_int,
            timeout => *const timespec,
            mask => *const sigset_t,
        ) -> c_int)
    })
}
