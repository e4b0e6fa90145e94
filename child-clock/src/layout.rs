//! What stands where in the page. All of it is atomic: bench and children read and write it at the same time.

use std::mem::offset_of;
use std::sync::atomic::{AtomicI64, AtomicU32, AtomicU64};

/// The first eight bytes.
pub(crate) const MAGIC: u64 = u64::from_ne_bytes(*b"rowsclck");
/// Changes with the layout.
pub(crate) const VERSION: u32 = 1;
/// Processes that can take part at a time.
pub(crate) const PROCESSES: usize = 128;
/// Waits with a time-out and running timers that the page has room for, of all processes.
pub const SLOTS: usize = 1024;

/// Nobody's slot, or one that is being written.
pub(crate) const FREE: u32 = 0;
/// Its owner waits for its deadline.
pub(crate) const WAITING: u32 = 1;
/// Its deadline has come, and its owner has not yet dealt with it.
pub(crate) const FIRED: u32 = 2;

#[repr(C)]
pub(crate) struct Layout {
    pub(crate) magic: AtomicU64,
    pub(crate) version: AtomicU32,
    /// Slots from the first on that have ever been used.
    pub(crate) used: AtomicU32,
    /// The children's monotonic clock.
    pub(crate) now_ns: AtomicU64,
    /// What must be added to it for nanoseconds since 1970.
    pub(crate) utc_offset_ns: AtomicI64,
    pub(crate) processes: [Process; PROCESSES],
    pub(crate) slots: [Slot; SLOTS],
}

#[repr(C)]
pub(crate) struct Process {
    /// Its number; 0: none.
    pub(crate) id: AtomicU32,
    /// Counts its timers that were fired. A futex.
    pub(crate) kicks: AtomicU32,
}

#[repr(C)]
#[derive(Debug)]
pub(crate) struct Slot {
    /// The process in the upper half, what waits there in the lower one; 0: nobody.
    pub(crate) owner: AtomicU64,
    pub(crate) deadline_ns: AtomicU64,
    /// A futex.
    pub(crate) state: AtomicU32,
    _unused: AtomicU32,
}

/// Programs without this library read by these.
const _: () = assert!(offset_of!(Layout, now_ns) == 16 && offset_of!(Layout, utc_offset_ns) == 24);

/// The owner of a slot.
pub(crate) fn owner(process: u32, waiter: u32) -> u64 {
    u64::from(process) << 32 | u64::from(waiter)
}

/// The process of an owner, and what waits in it.
pub(crate) fn owned_by(owner: u64) -> (u32, u32) {
    ((owner >> 32) as u32, owner as u32)
}
