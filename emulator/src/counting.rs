//! What a scanner has done, whichever family it is of.

use crate::lms2xx::SerialCounts;
use crate::scanner::Counter;

/// Tells what a scanner has done, for as long as anyone asks.
pub enum Counting {
    /// A scanner that speaks CoLa.
    Cola(Counter),
    /// An LMS2xx.
    Lms2xx(Box<dyn Fn() -> SerialCounts + Send + Sync>),
}

impl std::fmt::Debug for Counting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Cola(_) => "Counting::Cola",
            Self::Lms2xx(_) => "Counting::Lms2xx",
        })
    }
}
