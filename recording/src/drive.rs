//! When the drive of a recorded run began: what its scanners saw before, they saw of a tractor that stood.

use std::fmt;

/// The drive of a run whose tractor waits for its start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// It has not begun, as far as the recording goes.
    Awaited,
    /// It began at this log time, nanoseconds since 1970.
    Began(u64),
}

impl fmt::Display for Drive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Awaited => f.write_str("awaited"),
            Self::Began(at_ns) => at_ns.fmt(f),
        }
    }
}

impl Drive {
    /// From what [`Display`](fmt::Display) writes; `None` of anything else.
    pub(crate) fn from_text(text: &str) -> Option<Self> {
        match text {
            "awaited" => Some(Self::Awaited),
            at_ns => at_ns.parse().ok().map(Self::Began),
        }
    }
}
