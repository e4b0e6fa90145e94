//! `select` and `pselect`, by `poll`: the thread's own descriptor may have a number that a set has no room for.

use libc::{c_int, c_short, fd_set, pollfd, sigset_t, timespec, timeval};
use rowscan_child_clock::ChildPage;

use crate::errno;
use crate::instant::{after, ns, ns_of_timeval, read, timeval_of, write};
use crate::page::page;
use crate::polls::wait_until;
use crate::real::real;

/// A set of the caller's, what `poll` asks for it, and what puts a descriptor into the result: as the kernel has it.
const SETS: [(c_short, c_short); 3] = [
    (libc::POLLIN, libc::POLLIN | libc::POLLRDNORM | libc::POLLRDBAND | libc::POLLHUP | libc::POLLERR),
    (libc::POLLOUT, libc::POLLOUT | libc::POLLWRNORM | libc::POLLWRBAND | libc::POLLERR),
    (libc::POLLPRI, libc::POLLPRI),
];

/// Waits as `select` does; none where the C library must.
///
/// # Safety
/// The sets are null or hold `count` descriptors.
unsafe fn timed(
    page: &'static ChildPage,
    count: c_int,
    sets: [*mut fd_set; 3],
    deadline_ns: u64,
    mask: *const sigset_t,
) -> Option<c_int> {
    let is_in = |set: *mut fd_set, descriptor| {
        // SAFETY: the caller's promise.
        !set.is_null() && unsafe { libc::FD_ISSET(descriptor, set) }
    };
    let mut asked = Vec::new();
    for fd in 0..count.clamp(0, libc::FD_SETSIZE as c_int) {
        let wanted = sets.iter().zip(SETS).filter(|(set, _)| is_in(**set, fd));
        let events = wanted.fold(0, |events, (_, (ask, _))| events | ask);
        if events != 0 {
            asked.push(pollfd { fd, events, revents: 0 });
        }
    }
    let waited = wait_until(page, &mut asked, deadline_ns, mask)?;
    if waited < 0 {
        return Some(waited);
    }
    if asked.iter().any(|asked| asked.revents & libc::POLLNVAL != 0) {
        errno::set(libc::EBADF);
        return Some(-1);
    }
    let mut ready = 0;
    for (set, (ask, told)) in sets.into_iter().zip(SETS).filter(|(set, _)| !set.is_null()) {
        for asked in asked.iter().filter(|asked| asked.events & ask != 0) {
            match asked.revents & told {
                // SAFETY: the caller's promise; only who was in the set is taken out.
                0 => unsafe { libc::FD_CLR(asked.fd, set) },
                _ => ready += 1,
            }
        }
    }
    Some(ready)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn select(
    count: c_int,
    readable: *mut fd_set,
    writable: *mut fd_set,
    other: *mut fd_set,
    timeout: *mut timeval,
) -> c_int {
    let waited = || {
        let page = page()?;
        // SAFETY: the caller's.
        let ns = unsafe { read(timeout) }.and_then(|timeout| ns_of_timeval(&timeout)).filter(|ns| *ns > 0)?;
        let deadline = after(page, ns);
        // SAFETY: the caller's.
        let waited = unsafe { timed(page, count, [readable, writable, other], deadline, std::ptr::null()) }?;
        // SAFETY: the caller's.
        unsafe { write(timeout, timeval_of(deadline.saturating_sub(page.now_ns()))) };
        Some(waited)
    };
    waited().unwrap_or_else(|| {
        real!(select(
            count => c_int,
            readable => *mut fd_set,
            writable => *mut fd_set,
            other => *mut fd_set,
            timeout => *mut timeval,
        ) -> c_int)
    })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn pselect(
    count: c_int,
    readable: *mut fd_set,
    writable: *mut fd_set,
    other: *mut fd_set,
    timeout: *const timespec,
    mask: *const sigset_t,
) -> c_int {
    let waited = || {
        let page = page()?;
        // SAFETY: the caller's.
        let ns = unsafe { read(timeout) }.and_then(|timeout| ns(&timeout)).filter(|ns| *ns > 0)?;
        // SAFETY: the caller's.
        unsafe { timed(page, count, [readable, writable, other], after(page, ns), mask) }
    };
    waited().unwrap_or_else(|| {
        real!(pselect(
            count => c_int,
            readable => *mut fd_set,
            writable => *mut fd_set,
            other => *mut fd_set,
            timeout => *const timespec,
            mask => *const sigset_t,
        ) -> c_int)
    })
}
