//! What this library knows of descriptors: receive time-outs of sockets, timers, and its own ones.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::keeper::end_timer;
use crate::page::page;
use crate::real::real;
use crate::timer::{State, Timer};

/// Descriptors beyond this are left to the C library.
const KNOWN: usize = 8192;
/// From here on the library's own descriptors are, out of the way of programs that close what they know.
const OWN_FROM: i32 = 700;

pub(crate) struct Descriptor {
    /// Receive time-out of a socket, ns; 0: none.
    receive_ns: AtomicU64,
    /// The library's own: programs cannot close it.
    own: AtomicBool,
    pub(crate) timer: Timer,
}

static DESCRIPTORS: [Descriptor; KNOWN] = [const {
    Descriptor { receive_ns: AtomicU64::new(0), own: AtomicBool::new(false), timer: Timer::new() }
}; KNOWN];

pub(crate) fn known(descriptor: i32) -> Option<&'static Descriptor> {
    DESCRIPTORS.get(usize::try_from(descriptor).ok()?)
}

/// The receive time-out of a socket, ns.
pub(crate) fn receive_ns(descriptor: i32) -> Option<u64> {
    known(descriptor).map(|known| known.receive_ns.load(Ordering::Relaxed)).filter(|ns| *ns > 0)
}

/// Keeps a receive time-out; false if the descriptor is beyond those that are known.
pub(crate) fn set_receive_ns(descriptor: i32, ns: u64) -> bool {
    known(descriptor).map(|known| known.receive_ns.store(ns, Ordering::Relaxed)).is_some()
}

/// Forgets what was at this number: another file is, or nothing.
pub(crate) fn forget(descriptor: i32) {
    let Some(known) = known(descriptor) else { return };
    known.receive_ns.store(0, Ordering::Relaxed);
    if let Some(page) = page()
        && let Some(slot) = known.timer.set(State::NO_TIMER).slot
    {
        end_timer(page, slot, descriptor);
    }
}

/// In a forked child: timers of its parent's stay with that one.
pub(crate) fn forked() {
    DESCRIPTORS.iter().for_each(|known| known.timer.forked());
}

/// A number that stands for the same file as another has the same time-out.
fn copy(from: i32, to: i32) {
    if to >= 0 && from != to {
        forget(to);
        if let Some(ns) = receive_ns(from) {
            set_receive_ns(to, ns);
        }
    }
}

/// A thread's event descriptor, which ends with it.
struct Event {
    /// The process that made it.
    process: u32,
    descriptor: i32,
}

impl Event {
    fn make() -> Self {
        // SAFETY: no memory is handed over.
        let low = unsafe { libc::eventfd(0, libc::EFD_CLOEXEC | libc::EFD_NONBLOCK) };
        // SAFETY: as above.
        let high = unsafe { libc::fcntl(low, libc::F_DUPFD_CLOEXEC, OWN_FROM) };
        let descriptor = if high >= 0 { high } else { low };
        if high >= 0 {
            real!(close(low => i32) -> i32);
        }
        if let Some(known) = known(descriptor) {
            known.own.store(true, Ordering::Relaxed);
        }
        Self { process: std::process::id(), descriptor }
    }
}

impl Drop for Event {
    fn drop(&mut self) {
        if let Some(known) = known(self.descriptor) {
            known.own.store(false, Ordering::Relaxed);
        }
        real!(close(self.descriptor => i32) -> i32);
    }
}

/// The calling thread's event descriptor, on which the keeper tells it that its time has come. -1 where the system has none.
pub(crate) fn own_event() -> i32 {
    thread_local! {
        static OWN: RefCell<Option<Event>> = const { RefCell::new(None) };
    }
    let this = std::process::id();
    let event = |own: &RefCell<Option<Event>>| {
        let mut own = own.try_borrow_mut().ok()?;
        // A forked child shares its parent's, and must not listen there.
        match &mut *own {
            Some(event) if event.process == this => Some(event.descriptor),
            own => Some(own.insert(Event::make()).descriptor),
        }
    };
    OWN.try_with(event).ok().flatten().unwrap_or(-1)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn close(descriptor: i32) -> i32 {
    if known(descriptor).is_some_and(|known| known.own.load(Ordering::Relaxed)) {
        crate::errno::set(libc::EBADF);
        return -1;
    }
    forget(descriptor);
    real!(close(descriptor => i32) -> i32)
}

#[unsafe(no_mangle)]
unsafe extern "C" fn dup(from: i32) -> i32 {
    let to = real!(dup(from => i32) -> i32);
    copy(from, to);
    to
}

#[unsafe(no_mangle)]
unsafe extern "C" fn dup2(from: i32, to: i32) -> i32 {
    let made = real!(dup2(from => i32, to => i32) -> i32);
    copy(from, made);
    made
}

#[unsafe(no_mangle)]
unsafe extern "C" fn dup3(from: i32, to: i32, flags: i32) -> i32 {
    let made = real!(dup3(from => i32, to => i32, flags => i32) -> i32);
    copy(from, made);
    made
}

#[unsafe(no_mangle)]
unsafe extern "C" fn socket(domain: i32, kind: i32, protocol: i32) -> i32 {
    let made = real!(socket(domain => i32, kind => i32, protocol => i32) -> i32);
    forget(made);
    made
}
