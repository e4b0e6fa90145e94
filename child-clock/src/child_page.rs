//! A child's side of the page: it reads the time, and waits.

use std::fs::File;
use std::path::Path;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release};

use rustix::thread::{Timespec, futex, gettid};

use crate::PageError;
use crate::layout::{FIRED, FREE, Layout, MAGIC, SLOTS, Slot, VERSION, WAITING, owned_by, owner};
use crate::map::Map;

/// Numbers of waiters from here on are no threads: the kernel has no thread with such a number.
pub(crate) const TIMERS_FROM: u32 = 1 << 31;

/// So long that nobody waits longer. A wait without an end would be taken up again after a signal, which a sleep must not.
const LONG: Timespec = Timespec { tv_sec: 1 << 31, tv_nsec: 0 };

/// The page of this process.
#[derive(Debug)]
pub struct ChildPage {
    map: Map,
    /// This process's number, and its place in the page.
    process: AtomicU32,
    place: AtomicU32,
}

/// A slot with a deadline. Dropping it gives it up.
#[derive(Debug)]
pub struct Waiting<'a> {
    page: &'a ChildPage,
    slot: &'a Slot,
    number: usize,
}

impl ChildPage {
    /// Opens the page that a bench has made, and joins it.
    ///
    /// # Errors
    /// It cannot be opened or mapped, it is of another release, or has no room for another process.
    pub fn open(path: &Path) -> Result<Self, PageError> {
        let system = |what| move |cause| PageError::System { what, path: path.to_owned(), cause };
        let other = |found| PageError::Other { path: path.to_owned(), expected: VERSION, found };
        let file = File::options().read(true).write(true).open(path).map_err(system("open"))?;
        let size = file.metadata().map_err(system("look at"))?.len();
        if size != size_of::<Layout>() as u64 {
            return Err(other(format!("a file of {size} bytes")));
        }
        let map = Map::of(&file).map_err(system("map"))?;
        if map.magic.load(Acquire) != MAGIC {
            return Err(other("something else".to_owned()));
        }
        match map.version.load(Relaxed) {
            VERSION => {}
            version => return Err(other(format!("version {version}"))),
        }
        let page = Self { map, process: AtomicU32::new(0), place: AtomicU32::new(0) };
        match page.join() {
            true => Ok(page),
            false => Err(system("join")(std::io::Error::other("it has no room for another process"))),
        }
    }

    /// Joins it as this process, also after a fork; false if there is no room.
    pub fn join(&self) -> bool {
        let id = std::process::id();
        let processes = &self.map.processes;
        // A program that was started in another's place has its number.
        let before = processes.iter().position(|process| process.id.load(Acquire) == id);
        let free = || {
            let take = |process: &crate::layout::Process| {
                let found = process.id.load(Acquire);
                let is_gone = found == 0 || !Path::new(&format!("/proc/{found}")).exists();
                is_gone && process.id.compare_exchange(found, id, AcqRel, Acquire).is_ok()
            };
            processes.iter().position(take)
        };
        let Some(place) = before.or_else(free) else { return false };
        for slot in &self.map.slots {
            let holder = slot.owner.load(Acquire);
            if owned_by(holder).0 == id {
                slot.state.store(FREE, Release);
                slot.owner.store(0, Release);
            }
        }
        self.place.store(place as u32, Relaxed);
        self.process.store(id, Release);
        true
    }

    /// The monotonic clock.
    pub fn now_ns(&self) -> u64 {
        self.map.now_ns.load(Acquire)
    }

    /// Nanoseconds since 1970.
    pub fn utc_ns(&self) -> u64 {
        self.now_ns().saturating_add_signed(self.map.utc_offset_ns.load(Acquire))
    }

    /// A slot for what waits until `deadline_ns`: a thread ([`in_thread`]), or a number that [`ChildPage::timer`] makes. None if the page is full.
    pub fn wait_until(&self, deadline_ns: u64, waiter: u32) -> Option<Waiting<'_>> {
        let owner = owner(self.process.load(Acquire), waiter);
        let free = |slot: &Slot| {
            slot.owner.load(Relaxed) == 0 && slot.owner.compare_exchange(0, owner, AcqRel, Acquire).is_ok()
        };
        let number = self.map.slots.iter().position(free)?;
        let slot = self.map.slots.get(number)?;
        self.map.used.fetch_max(number as u32 + 1, AcqRel);
        slot.deadline_ns.store(deadline_ns, Release);
        slot.state.store(WAITING, Release);
        Some(Waiting { page: self, slot, number })
    }

    /// A waiter that is no thread.
    pub fn timer(number: u32) -> u32 {
        TIMERS_FROM | number
    }

    /// How often timers of this process were fired.
    pub fn kicks(&self) -> u32 {
        self.kicks_word().map_or(0, |kicks| kicks.load(Acquire))
    }

    /// Waits until that is no longer `seen`; or for less, as after a signal.
    pub fn wait_for_kick(&self, seen: u32) {
        if let Some(kicks) = self.kicks_word() {
            let _ = futex::wait(kicks, futex::Flags::empty(), seen, None);
        }
    }

    fn kicks_word(&self) -> Option<&AtomicU32> {
        Some(&self.map.processes.get(self.place.load(Relaxed) as usize)?.kicks)
    }

    /// Whether slot `number` is one of this process that has fired.
    pub fn has_fired(&self, number: usize) -> bool {
        let own = |slot: &&Slot| owned_by(slot.owner.load(Acquire)).0 == self.process.load(Acquire);
        self.map.slots.get(number).filter(own).is_some_and(|slot| self.is_fired(slot))
    }

    fn is_fired(&self, slot: &Slot) -> bool {
        if slot.state.load(Acquire) != FIRED {
            return false;
        }
        // The bench may have meant the wait before, in the same slot.
        let is_due = slot.deadline_ns.load(Acquire) <= self.now_ns();
        if !is_due {
            let _ = slot.state.compare_exchange(FIRED, WAITING, AcqRel, Acquire);
        }
        is_due
    }

    /// A timer that has fired waits again, until `deadline_ns`.
    pub fn wait_again(&self, number: usize, deadline_ns: u64) {
        if let Some(slot) = self.map.slots.get(number) {
            slot.deadline_ns.store(deadline_ns, Release);
            slot.state.store(WAITING, Release);
        }
    }

    /// A timer is over.
    pub fn give_up(&self, number: usize) {
        if let Some(slot) = self.map.slots.get(number) {
            slot.state.store(FREE, Release);
            slot.owner.store(0, Release);
        }
    }

    /// Slots that may be in use, from the first on.
    pub fn used(&self) -> usize {
        (self.map.used.load(Acquire) as usize).min(SLOTS)
    }
}

/// The calling thread, as a waiter.
pub fn in_thread() -> u32 {
    gettid().as_raw_nonzero().get().unsigned_abs()
}

impl Waiting<'_> {
    /// Its number in the page.
    pub fn number(&self) -> usize {
        self.number
    }

    /// Whether its time has come.
    pub fn has_fired(&self) -> bool {
        self.page.is_fired(self.slot)
    }

    /// Sleeps until its time has come; false if a signal came first.
    pub fn sleep(&self) -> bool {
        while !self.has_fired() {
            // What else it may say is that the state has changed.
            let waited = futex::wait(&self.slot.state, futex::Flags::empty(), WAITING, Some(&LONG));
            if waited == Err(rustix::io::Errno::INTR) {
                return false;
            }
        }
        true
    }

    /// Keeps it beyond this value: a timer that no thread waits for.
    pub fn keep(self) -> usize {
        let number = self.number;
        std::mem::forget(self);
        number
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.slot.state.store(FREE, Release);
        self.slot.owner.store(0, Release);
    }
}
