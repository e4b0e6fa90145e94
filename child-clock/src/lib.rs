//! Simulated time for the children of a test bench.
//!
//! Bench and children map one file, the *page*. The bench writes what time it is ([`BenchPage::set`]) and fires the children's timers, one after
//! the other ([`BenchPage::fire_next`]). A thread of a child that waits with a time-out puts its deadline into a slot ([`ChildPage::wait_until`]),
//! so the bench knows the earliest one and no time passes it by. `preload/` makes a C library's calls of this, for programs that know nothing of it.
//!
//! A program that reads the time only needs bytes 16 to 31 of the page: `now_ns` (u64) and `utc_offset_ns` (i64), in the machine's byte order.

#[cfg_attr(not(target_os = "linux"), path = "bench_page_elsewhere.rs")]
mod bench_page;
#[cfg(target_os = "linux")]
mod child_page;
#[cfg(target_os = "linux")]
mod layout;
#[cfg(target_os = "linux")]
mod map;

use std::path::PathBuf;

pub use bench_page::{BenchPage, Timer};
#[cfg(target_os = "linux")]
pub use child_page::{ChildPage, Waiting, in_thread};
#[cfg(target_os = "linux")]
pub use layout::SLOTS;

/// The children's monotonic clock when the page is made, ns: as on a machine that has been up for a while, so that an instant "long ago" can be told.
pub const START_NS: u64 = 1_000_000_000_000;

/// The environment variable that tells a child where its page is.
pub const VARIABLE: &str = "ROWSCAN_TIME_PAGE";

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    /// The system refuses it.
    #[error("cannot {what} the page of simulated time {}: {cause}", path.display())]
    System {
        /// What was tried.
        what: &'static str,
        /// The page.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The file is no page, or one of another version.
    #[error(
        "{}: expected a page of simulated time, version {expected}, found {found}; it must come from the bench of the same release",
        path.display()
    )]
    Other {
        /// The file.
        path: PathBuf,
        /// The version of this library.
        expected: u32,
        /// What it is.
        found: String,
    },
}
