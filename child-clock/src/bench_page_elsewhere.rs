//! Where no futex joins two processes there is no page.

use std::convert::Infallible;
use std::path::Path;

use crate::PageError;

/// A page: it cannot be made.
#[derive(Debug)]
pub struct BenchPage(Infallible);

/// A timer of a child.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Timer {
    /// By the children's monotonic clock.
    pub deadline_ns: u64,
    /// Its process.
    pub process: u32,
}

#[expect(missing_docs, reason = "as on Linux")]
impl BenchPage {
    pub fn create(path: &Path) -> Result<Self, PageError> {
        let cause = std::io::Error::new(std::io::ErrorKind::Unsupported, "this needs Linux");
        Err(PageError::System { what: "make", path: path.to_owned(), cause })
    }

    pub fn path(&self) -> &Path {
        match self.0 {}
    }

    pub fn now_ns(&self) -> u64 {
        match self.0 {}
    }

    pub fn set(&self, _: u64) {
        match self.0 {}
    }

    pub fn set_utc_offset(&self, _: i64) {
        match self.0 {}
    }

    pub fn processes(&self) -> impl Iterator<Item = u32> {
        std::iter::empty()
    }

    pub fn waiting(&self) -> impl Iterator<Item = Timer> {
        std::iter::empty()
    }

    pub fn earliest(&self) -> Option<Timer> {
        match self.0 {}
    }

    pub fn fire_next(&self, _: u64) -> Option<Timer> {
        match self.0 {}
    }

    pub fn firing(&self) -> Option<Timer> {
        match self.0 {}
    }
}
