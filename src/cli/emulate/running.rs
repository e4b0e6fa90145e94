//! Emulated scanners that run, and what they have done.

use rowscan_emulator::{Counting, Emulator, SerialEmulator};

use super::super::client_limits;
use super::super::events::End;

/// A scanner that is set up, and where clients find it.
pub(super) enum Running {
    Cola(Emulator),
    Lms2xx(SerialEmulator),
}

impl Running {
    /// Tells what it has done at any time, as [`Running::end`] does.
    pub(super) fn counts(&self) -> Counting {
        match self {
            Self::Cola(emulator) => emulator.into(),
            Self::Lms2xx(emulator) => emulator.into(),
        }
    }

    /// What it has done, for scripts.
    pub(super) fn end<'a>(&self, stream: Option<&'a str>) -> End<'a> {
        match self {
            Self::Cola(emulator) => End::cola(stream, &emulator.counts()),
            Self::Lms2xx(emulator) => End::lms2xx(stream, emulator.counts()),
        }
    }

    /// Scans that the host was too slow for. An LMS2xx sends what it has, late.
    pub(super) fn missed(&self) -> u64 {
        match self {
            Self::Cola(emulator) => emulator.counts().scans_missed,
            Self::Lms2xx(_) => 0,
        }
    }

    /// One line for people on what it has done.
    pub(super) fn summary(&self) -> String {
        match self {
            Self::Cola(emulator) => {
                let counts = emulator.counts();
                format!(
                    "{} scans sent, {} dropped for slow clients, {} missed by a slow host; {}",
                    counts.scans_sent,
                    counts.scans_dropped,
                    counts.scans_missed,
                    client_limits::told(&counts)
                )
            }
            Self::Lms2xx(emulator) => {
                let counts = emulator.counts();
                format!("{} scans sent, {} bytes not taken", counts.scans_sent, counts.bytes_lost)
            }
        }
    }
}
