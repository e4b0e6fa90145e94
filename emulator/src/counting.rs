//! What a scanner has done, whichever family it is of.

use crate::lms2xx::SerialCounts;
use crate::scanner::{Counter, Emulator};
use crate::serial_emulator::SerialEmulator;

/// Tells what a scanner has done, for as long as anyone asks.
pub enum Counting {
    /// A scanner that speaks CoLa.
    Cola(Counter),
    /// An LMS2xx.
    Lms2xx(Box<dyn Fn() -> SerialCounts + Send + Sync>),
}

impl From<&Emulator> for Counting {
    fn from(emulator: &Emulator) -> Self {
        Self::Cola(emulator.counter())
    }
}

impl From<&SerialEmulator> for Counting {
    fn from(emulator: &SerialEmulator) -> Self {
        Self::Lms2xx(Box::new(emulator.counting()))
    }
}

impl std::fmt::Debug for Counting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Cola(_) => "Counting::Cola",
            Self::Lms2xx(_) => "Counting::Lms2xx",
        })
    }
}
