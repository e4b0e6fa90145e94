//! Events for scripts beside the endpoints: that all of these are there, and what had been done by the end.

use rowscan_emulator::{EmulatorCounts, SerialCounts};
use serde::Serialize;

use super::output::print_event;
use super::{Failure, Format, service};

#[derive(Serialize)]
struct Ready {
    event: &'static str,
}

/// Tells scripts, and the service manager, that every endpoint has been announced.
pub(super) fn ready(format: Format) -> Result<(), Failure> {
    service::ready();
    match format {
        Format::Json | Format::Jsonl => print_event(&Ready { event: "ready" }),
        Format::Csv | Format::Table => Ok(()),
    }
}

/// What one scanner had done by the end.
#[derive(Serialize)]
pub(super) struct End<'a> {
    event: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    stream: Option<&'a str>,
    #[serde(flatten)]
    counted: Counted,
}

/// What one scanner has done.
#[derive(Serialize)]
pub(super) struct Counted {
    scans_sent: u64,
    #[serde(flatten)]
    of: Of,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Of {
    Cola {
        /// Telegrams that clients were too slow to take.
        scans_dropped: u64,
        /// Scans left out because the host was too slow.
        scans_missed: u64,
        connections_refused: u64,
        connections_silent: u64,
        connections_idle: u64,
    },
    Lms2xx {
        bytes_lost: u64,
    },
}

impl Counted {
    /// Of a CoLa scanner.
    pub(super) fn cola(counts: &EmulatorCounts) -> Self {
        let of = Of::Cola {
            scans_dropped: counts.scans_dropped,
            scans_missed: counts.scans_missed,
            connections_refused: counts.connections_refused,
            connections_silent: counts.connections_silent,
            connections_idle: counts.connections_idle,
        };
        Self { scans_sent: counts.scans_sent, of }
    }

    /// Of an LMS2xx.
    pub(super) fn lms2xx(counts: SerialCounts) -> Self {
        Self { scans_sent: counts.scans_sent, of: Of::Lms2xx { bytes_lost: counts.bytes_lost } }
    }
}

impl<'a> End<'a> {
    /// Of a CoLa scanner.
    pub(super) fn cola(stream: Option<&'a str>, counts: &EmulatorCounts) -> Self {
        Self { event: "end", stream, counted: Counted::cola(counts) }
    }

    /// Of an LMS2xx.
    pub(super) fn lms2xx(stream: Option<&'a str>, counts: SerialCounts) -> Self {
        Self { event: "end", stream, counted: Counted::lms2xx(counts) }
    }

    /// Tells scripts.
    pub(super) fn tell(&self, format: Format) -> Result<(), Failure> {
        match format {
            Format::Json | Format::Jsonl => print_event(self),
            Format::Csv | Format::Table => Ok(()),
        }
    }
}
