//! The bench's side of the page: it says what time it is, and fires timers.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release};

use rustix::process::{Pid, test_kill_process};
use rustix::thread::futex;

use crate::child_page::TIMERS_FROM;
use crate::layout::{FIRED, FREE, Layout, MAGIC, Slot, VERSION, WAITING, owned_by};
use crate::map::Map;
use crate::{PageError, START_NS};

/// A page that this process has made.
#[derive(Debug)]
pub struct BenchPage {
    map: Map,
    path: PathBuf,
}

/// A timer of a child.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Timer {
    /// By the children's monotonic clock.
    pub deadline_ns: u64,
    /// Place of its process among those of the page.
    place: usize,
    /// The thread that waits, or a number of its process for what no thread waits for.
    waiter: u32,
    /// Its process.
    pub process: u32,
}

impl BenchPage {
    /// Makes the file; the children's monotonic clock stands at [`START_NS`].
    ///
    /// # Errors
    /// The file cannot be made or mapped.
    pub fn create(path: &Path) -> Result<Self, PageError> {
        let system = |what| move |cause| PageError::System { what, path: path.to_owned(), cause };
        let file = File::options().read(true).write(true).create_new(true).open(path);
        let file = file.map_err(system("make"))?;
        file.set_len(size_of::<Layout>() as u64).map_err(system("size"))?;
        let map = Map::of(&file).map_err(system("map"))?;
        map.now_ns.store(START_NS, Relaxed);
        map.version.store(VERSION, Relaxed);
        map.magic.store(MAGIC, Release);
        Ok(Self { map, path: path.to_owned() })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The children's monotonic clock.
    pub fn now_ns(&self) -> u64 {
        self.map.now_ns.load(Acquire)
    }

    /// Lets it be `now_ns`; it never goes back. This alone fires nothing.
    pub fn set(&self, now_ns: u64) {
        self.map.now_ns.fetch_max(now_ns, AcqRel);
    }

    /// What children add to their monotonic clock for nanoseconds since 1970.
    pub fn set_utc_offset(&self, offset_ns: i64) {
        self.map.utc_offset_ns.store(offset_ns, Release);
    }

    /// The processes that take part, those that have ended left out.
    pub fn processes(&self) -> impl Iterator<Item = u32> {
        let ids = self.map.processes.iter().map(|process| process.id.load(Acquire));
        ids.filter(|id| *id != 0 && is_there(*id))
    }

    /// Timers that wait.
    pub fn waiting(&self) -> impl Iterator<Item = Timer> {
        self.timers(WAITING).map(|(timer, _)| timer)
    }

    /// The timer that comes first. Of those of one instant the processes' order decides, as they joined, then that of their threads, as they were
    /// started.
    pub fn earliest(&self) -> Option<Timer> {
        self.waiting().min()
    }

    /// Fires the first timer that is due until `now_ns`. Its owner then deals with it: see [`BenchPage::firing`].
    pub fn fire_next(&self, now_ns: u64) -> Option<Timer> {
        loop {
            let (timer, slot) = self.timers(WAITING).min_by_key(|(timer, _)| *timer)?;
            if timer.deadline_ns > now_ns {
                return None;
            }
            let fired = slot.state.compare_exchange(WAITING, FIRED, AcqRel, Acquire).is_ok();
            // Its owner may have given it up meanwhile, or not live any more.
            if !fired || !is_alive(&timer) {
                self.drop_dead(&timer, slot, fired);
                continue;
            }
            let _ = futex::wake(&slot.state, futex::Flags::empty(), u32::MAX >> 1);
            if let Some(process) = self.map.processes.get(timer.place) {
                process.kicks.fetch_add(1, AcqRel);
                let _ = futex::wake(&process.kicks, futex::Flags::empty(), u32::MAX >> 1);
            }
            return Some(timer);
        }
    }

    /// A timer that was fired and that its owner has not yet dealt with.
    pub fn firing(&self) -> Option<Timer> {
        self.timers(FIRED).map(|(timer, _)| timer).find(is_alive)
    }

    /// Frees the slot of an owner that is gone, or that gave it up.
    fn drop_dead(&self, timer: &Timer, slot: &Slot, fired: bool) {
        if fired && !is_alive(timer) {
            slot.state.store(FREE, Release);
            slot.owner.store(0, Release);
        }
    }

    fn timers(&self, state: u32) -> impl Iterator<Item = (Timer, &Slot)> {
        let used = self.map.used.load(Acquire) as usize;
        let slots = self.map.slots.iter().take(used);
        slots.filter(move |slot| slot.state.load(Acquire) == state).filter_map(|slot| {
            let (process, waiter) = owned_by(slot.owner.load(Acquire));
            let place = self.map.processes.iter().position(|known| known.id.load(Acquire) == process)?;
            let deadline_ns = slot.deadline_ns.load(Acquire);
            Some((Timer { deadline_ns, place, waiter, process }, slot))
        })
    }
}

/// Whether somebody is there to deal with a timer.
fn is_alive(timer: &Timer) -> bool {
    match timer.waiter < TIMERS_FROM {
        true => Path::new(&format!("/proc/{}/task/{}", timer.process, timer.waiter)).exists(),
        false => is_there(timer.process),
    }
}

/// Whether there is such a process. One that another user owns is there.
fn is_there(process: u32) -> bool {
    let id = i32::try_from(process).ok().and_then(Pid::from_raw);
    id.is_some_and(|id| test_kill_process(id) != Err(rustix::io::Errno::SRCH))
}
