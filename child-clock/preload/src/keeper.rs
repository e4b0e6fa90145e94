//! The timekeeper: a thread that ends the waits of the others when the bench fires their slots.
//!
//! A thread that only sleeps waits for its slot itself. All others wait in the system for something else as well, so they leave with their slot
//! what ends that ([`Poke`]). The keeper is started with the first of them.

use std::sync::atomic::{AtomicBool, Ordering};

use rowscan_child_clock::{ChildPage, SLOTS, Waiting, in_thread};
use rustix::thread::Timespec;

use crate::lock::Lock;
use crate::page;
use crate::system_call::wake_all;
use crate::timer::Timer;

/// What ends the wait that a slot belongs to.
#[derive(Clone, Copy)]
pub(crate) enum Poke {
    /// Nobody waits.
    Nothing,
    /// A byte for the thread's own descriptor.
    Event(i32),
    /// A broadcast: those who wait without a time-out take it as spurious.
    Condition(*mut libc::pthread_cond_t),
    /// A wake-up of all who wait for this word, with the flag of private ones.
    Futex(*const u32, i32),
    /// A timer's expiration, for its descriptor.
    Timer(i32, &'static Timer),
}

// SAFETY: its addresses are used under the lock of their slot, while their owner waits.
unsafe impl Send for Poke {}

static POKES: [Lock<Poke>; SLOTS] = [const { Lock::new(Poke::Nothing) }; SLOTS];
static RUNS: AtomicBool = AtomicBool::new(false);

/// Between two pokes at a wait that has not ended: one may come before the thread is in the system. 50 µs.
const AGAIN: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000 };

/// A wait of this thread, which the keeper ends.
pub(crate) struct Wait {
    waiting: Waiting<'static>,
}

impl Wait {
    /// Begins one; none if the page or the system has no room for it.
    pub(crate) fn begin(page: &'static ChildPage, deadline_ns: u64, poke: Poke) -> Option<Self> {
        start()?;
        let waiting = page.wait_until(deadline_ns, in_thread())?;
        *POKES.get(waiting.number())?.lock() = poke;
        Some(Self { waiting })
    }

    pub(crate) fn has_fired(&self) -> bool {
        self.waiting.has_fired()
    }
}

impl Drop for Wait {
    fn drop(&mut self) {
        // Under its lock: the keeper uses no address beyond this.
        if let Some(poke) = POKES.get(self.waiting.number()) {
            *poke.lock() = Poke::Nothing;
        }
    }
}

/// A timer that no thread waits for: its slot.
pub(crate) fn begin_timer(
    page: &'static ChildPage,
    deadline_ns: u64,
    descriptor: i32,
    timer: &'static Timer,
) -> Option<usize> {
    start()?;
    let waiter = ChildPage::timer(descriptor.unsigned_abs());
    let waiting = page.wait_until(deadline_ns, waiter)?;
    *POKES.get(waiting.number())?.lock() = Poke::Timer(descriptor, timer);
    Some(waiting.keep())
}

/// Ends one, unless it has ended by itself.
pub(crate) fn end_timer(page: &ChildPage, slot: usize, descriptor: i32) {
    if let Some(poke) = POKES.get(slot) {
        let mut poke = poke.lock();
        if matches!(*poke, Poke::Timer(of, _) if of == descriptor) {
            *poke = Poke::Nothing;
            page.give_up(slot);
        }
    }
}

/// In a forked child there is no keeper, and nobody waits.
pub(crate) fn forked() {
    RUNS.store(false, Ordering::Release);
    for poke in &POKES {
        poke.open();
        *poke.lock() = Poke::Nothing;
    }
}

/// Starts the keeper, if it does not run.
fn start() -> Option<()> {
    if RUNS.swap(true, Ordering::AcqRel) {
        return Some(());
    }
    let started = spawn();
    RUNS.store(started, Ordering::Release);
    started.then_some(())
}

/// A thread that gets no signal: those are the program's.
fn spawn() -> bool {
    // SAFETY: sets and attributes are made by the C library before they are used; the thread gets no argument.
    unsafe {
        let (mut all, mut before): (libc::sigset_t, libc::sigset_t) =
            (std::mem::zeroed(), std::mem::zeroed());
        libc::sigfillset(&mut all);
        libc::pthread_sigmask(libc::SIG_SETMASK, &all, &mut before);
        let mut attributes: libc::pthread_attr_t = std::mem::zeroed();
        libc::pthread_attr_init(&mut attributes);
        libc::pthread_attr_setdetachstate(&mut attributes, libc::PTHREAD_CREATE_DETACHED);
        let mut thread = std::mem::zeroed();
        let started = libc::pthread_create(&mut thread, &attributes, keep, std::ptr::null_mut()) == 0;
        libc::pthread_attr_destroy(&mut attributes);
        libc::pthread_sigmask(libc::SIG_SETMASK, &before, std::ptr::null_mut());
        started
    }
}

extern "C" fn keep(_: *mut libc::c_void) -> *mut libc::c_void {
    let Some(page) = page::page() else { return std::ptr::null_mut() };
    loop {
        let seen = page.kicks();
        let mut fired = false;
        for (number, poke) in POKES.iter().enumerate().take(page.used()) {
            if page.has_fired(number) {
                fired |= poke_at(page, number, poke);
            }
        }
        match fired {
            true => drop(rustix::thread::nanosleep(&AGAIN)),
            false => page.wait_for_kick(seen),
        }
    }
}

/// Ends the wait of a slot that has fired; true if the keeper must look again.
fn poke_at(page: &'static ChildPage, number: usize, poke: &Lock<Poke>) -> bool {
    let mut poke = poke.lock();
    match *poke {
        // It waits by itself, or has not yet said how.
        Poke::Nothing => true,
        Poke::Event(descriptor) => {
            ring(descriptor);
            true
        }
        Poke::Condition(condition) => {
            // SAFETY: its owner waits, and cannot leave the wait without this lock.
            unsafe { libc::pthread_cond_broadcast(condition) };
            true
        }
        Poke::Futex(word, private) => {
            // SAFETY: the kernel takes an address that is not mapped for an error.
            unsafe { wake_all(word, private) };
            true
        }
        Poke::Timer(descriptor, timer) => {
            ring(descriptor);
            match timer.expired() {
                Some(next) => page.wait_again(number, next),
                None => {
                    *poke = Poke::Nothing;
                    page.give_up(number);
                }
            }
            false
        }
    }
}

/// Adds one to an event descriptor.
fn ring(descriptor: i32) {
    if descriptor >= 0 {
        // SAFETY: it is open: its owner waits, or has a timer there.
        let descriptor = unsafe { std::os::fd::BorrowedFd::borrow_raw(descriptor) };
        let _ = rustix::io::write(descriptor, &1_u64.to_ne_bytes());
    }
}
