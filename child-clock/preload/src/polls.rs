//! `poll` and `ppoll`; and the wait for descriptors that the others are made of.

use libc::{c_int, nfds_t, pollfd, sigset_t, timespec};
use rowscan_child_clock::ChildPage;

use crate::descriptors::own_event;
use crate::instant::{after, ns, read};
use crate::keeper::{Poke, Wait};
use crate::page::page;
use crate::real::real;

/// Descriptors, beside the thread's own, that need no memory of their own.
const FEW: usize = 16;

/// Waits until one of `descriptors` is ready (how many are), the page's clock shows `deadline_ns` (0) or a signal comes (-1, `errno`). None where that
/// cannot be had; nothing has been waited for then.
pub(crate) fn wait_until(
    page: &'static ChildPage,
    descriptors: &mut [pollfd],
    deadline_ns: u64,
    mask: *const sigset_t,
) -> Option<c_int> {
    let mut few = [pollfd { fd: -1, events: 0, revents: 0 }; FEW + 1];
    let mut many = Vec::new();
    let count = descriptors.len();
    let all = match few.get_mut(..=count) {
        Some(few) => few,
        None => {
            many.resize(count + 1, few[0]);
            many.as_mut_slice()
        }
    };
    all.get_mut(..count)?.copy_from_slice(descriptors);
    let event = own_event();
    *all.last_mut()? = pollfd { fd: event, events: libc::POLLIN, revents: 0 };
    let wait = Wait::begin(page, deadline_ns, Poke::Event(event)).filter(|_| event >= 0)?;
    loop {
        let ready = call(all, std::ptr::null(), mask);
        if ready < 0 {
            return Some(ready);
        }
        let poked = all.last().is_some_and(|own| own.revents != 0);
        if poked {
            drain(event);
        }
        let ready = ready - c_int::from(poked);
        if ready > 0 || wait.has_fired() {
            descriptors.copy_from_slice(all.get(..count)?);
            return Some(ready);
        }
        // An earlier wait's.
    }
}

/// The system's own wait.
pub(crate) fn call(descriptors: &mut [pollfd], timeout: *const timespec, mask: *const sigset_t) -> c_int {
    let (at, count) = (descriptors.as_mut_ptr(), descriptors.len() as nfds_t);
    real!(ppoll(at => *mut pollfd, count => nfds_t, timeout => *const timespec, mask => *const sigset_t) -> c_int)
}

/// Takes what the keeper has left.
fn drain(event: c_int) {
    // SAFETY: this thread's own, which stays open.
    let event = unsafe { std::os::fd::BorrowedFd::borrow_raw(event) };
    let _ = rustix::io::read(event, &mut [0; 8]);
}

/// Waits as `poll` does with a time-out of so many nanoseconds; none where the C library must.
///
/// # Safety
/// `at` holds `count` descriptors.
unsafe fn timed(at: *mut pollfd, count: nfds_t, timeout_ns: u64, mask: *const sigset_t) -> Option<c_int> {
    let page = page().filter(|_| timeout_ns > 0)?;
    let descriptors = match count {
        0 => &mut [],
        // SAFETY: the caller's promise.
        _ => unsafe { std::slice::from_raw_parts_mut(at, usize::try_from(count).ok()?) },
    };
    wait_until(page, descriptors, after(page, timeout_ns), mask)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn poll(at: *mut pollfd, count: nfds_t, timeout_ms: c_int) -> c_int {
    let ns = u64::try_from(timeout_ms).unwrap_or(0) * 1_000_000;
    // SAFETY: the caller's.
    let waited = unsafe { timed(at, count, ns, std::ptr::null()) };
    waited.unwrap_or_else(|| real!(poll(at => *mut pollfd, count => nfds_t, timeout_ms => c_int) -> c_int))
}

#[unsafe(no_mangle)]
unsafe extern "C" fn ppoll(
    at: *mut pollfd,
    count: nfds_t,
    timeout: *const timespec,
    mask: *const sigset_t,
) -> c_int {
    // SAFETY: the caller's.
    let waited =
        unsafe { read(timeout).and_then(|timeout| ns(&timeout)).and_then(|ns| timed(at, count, ns, mask)) };
    waited.unwrap_or_else(|| {
        real!(ppoll(
            at => *mut pollfd,
            count => nfds_t,
            timeout => *const timespec,
            mask => *const sigset_t,
        ) -> c_int)
    })
}

/// What `poll` is where a compiler checks sizes.
#[unsafe(no_mangle)]
unsafe extern "C" fn __poll_chk(at: *mut pollfd, count: nfds_t, timeout_ms: c_int, _: usize) -> c_int {
    // SAFETY: the caller's.
    unsafe { poll(at, count, timeout_ms) }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn __ppoll_chk(
    at: *mut pollfd,
    count: nfds_t,
    timeout: *const timespec,
    mask: *const sigset_t,
    _: usize,
) -> c_int {
    // SAFETY: the caller's.
    unsafe { ppoll(at, count, timeout, mask) }
}
