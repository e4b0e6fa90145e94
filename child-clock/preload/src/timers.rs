//! Timer descriptors: an event descriptor in the place of each, to which the keeper adds expirations.

use libc::{c_int, itimerspec};
use rowscan_child_clock::ChildPage;

use crate::descriptors::{forget, known};
use crate::errno;
use crate::instant::{Clock, after, ns, read, timespec_of, write};
use crate::keeper::{begin_timer, end_timer};
use crate::page::page;
use crate::real::real;
use crate::timer::{State, Timer};

#[unsafe(no_mangle)]
unsafe extern "C" fn timerfd_create(clock: c_int, flags: c_int) -> c_int {
    let made = page().zip(Clock::of(clock)).and_then(|(_, clock)| {
        let mut event_flags = 0;
        for (timer, event) in
            [(libc::TFD_NONBLOCK, libc::EFD_NONBLOCK), (libc::TFD_CLOEXEC, libc::EFD_CLOEXEC)]
        {
            if flags & timer != 0 {
                event_flags |= event;
            }
        }
        // SAFETY: no memory is handed over.
        let made = unsafe { libc::eventfd(0, event_flags) };
        let known = known(made)?;
        forget(made);
        known.timer.set(State::unset(clock));
        Some(made)
    });
    made.unwrap_or_else(|| real!(timerfd_create(clock => c_int, flags => c_int) -> c_int))
}

/// The timer behind a descriptor, with its clock; none if it is not one of ours.
fn timer(descriptor: c_int) -> Option<(&'static ChildPage, &'static Timer, Clock)> {
    let timer = &known(descriptor)?.timer;
    let clock = timer.state().clock?;
    Some((page()?, timer, clock))
}

#[unsafe(no_mangle)]
unsafe extern "C" fn timerfd_settime(
    descriptor: c_int,
    flags: c_int,
    new: *const itimerspec,
    old: *mut itimerspec,
) -> c_int {
    let Some((page, timer, clock)) = timer(descriptor) else {
        return real!(timerfd_settime(
            descriptor => c_int,
            flags => c_int,
            new => *const itimerspec,
            old => *mut itimerspec,
        ) -> c_int);
    };
    // SAFETY: the caller's.
    let wanted = unsafe { read(new) }.and_then(|new| Some((ns(&new.it_value)?, ns(&new.it_interval)?)));
    let Some((value, interval_ns)) = wanted else {
        errno::set(libc::EINVAL);
        return -1;
    };
    let before = timer.set(State::unset(clock));
    // SAFETY: the caller's.
    unsafe { write(old, before.setting(page)) };
    if let Some(slot) = before.slot {
        end_timer(page, slot, descriptor);
    }
    clear(descriptor);
    if value == 0 {
        return 0;
    }
    let is_absolute = flags & libc::TFD_TIMER_ABSTIME != 0;
    let deadline_ns = if is_absolute { clock.deadline(page, value) } else { after(page, value) };
    let state = State { deadline_ns, interval_ns, ..State::unset(clock) };
    timer.set(state);
    // Not under its lock: the keeper takes that with the slot's already held.
    let slot = begin_timer(page, deadline_ns, descriptor, timer);
    timer.set(State { slot, ..timer.state() });
    if slot.is_none() {
        errno::set(libc::ENOMEM);
        return -1;
    }
    0
}

#[unsafe(no_mangle)]
unsafe extern "C" fn timerfd_gettime(descriptor: c_int, now: *mut itimerspec) -> c_int {
    match timer(descriptor) {
        Some((page, timer, _)) => {
            // SAFETY: the caller's.
            unsafe { write(now, timer.state().setting(page)) };
            0
        }
        None => real!(timerfd_gettime(descriptor => c_int, now => *mut itimerspec) -> c_int),
    }
}

/// Expirations that nobody has read go with the setting that made them.
fn clear(descriptor: c_int) {
    let mut asked = [libc::pollfd { fd: descriptor, events: libc::POLLIN, revents: 0 }];
    let at_once = timespec_of(0);
    if crate::polls::call(&mut asked, &raw const at_once, std::ptr::null()) == 1 {
        // SAFETY: it is open, and there is something to read.
        let descriptor = unsafe { std::os::fd::BorrowedFd::borrow_raw(descriptor) };
        let _ = rustix::io::read(descriptor, &mut [0; 8]);
    }
}
