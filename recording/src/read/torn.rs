//! A file that breaks off.

use std::fmt;

/// Where a file ends too early, or stops making sense. All before is read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Torn {
    /// Byte of the file where the broken part begins.
    pub offset: u64,
    /// What should stand there.
    pub expected: &'static str,
    /// What is there instead.
    pub found: String,
}

impl fmt::Display for Torn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "broken off at byte {}: expected {}, found {}", self.offset, self.expected, self.found)
    }
}
