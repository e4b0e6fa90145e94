//! What a scanner has done, whichever family it is of.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use rowscan_faults::StreamFaults;
use rowscan_ports::in_flight::InFlight;

use crate::datagrams::DatagramCounts;
use crate::lms2xx::SerialCounts;
use crate::refused_settings::RefusedSetting;
use crate::scanner::Emulator;
use crate::serial_emulator::SerialEmulator;
use crate::shared::EmulatorCounts;

/// What a virtual scanner has done. What its family does not count is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScannerCounts {
    /// Scan telegrams handed to clients.
    pub scans_sent: u64,
    /// Scan telegrams that clients, or a line, were too slow to take.
    pub scans_dropped: Option<u64>,
    /// Scan telegrams, of those sent, that faults have kept from their client; none where nothing can go wrong there.
    pub scans_kept_by_faults: Option<u64>,
    /// Scans left out because the host was too slow.
    pub scans_missed: Option<u64>,
    /// Scans measured while nobody took them.
    pub scans_unheard: Option<u64>,
    /// The number in the last scan telegram that was measured, taken or not.
    pub last_counter: Option<u16>,
    /// How often it has begun to number its scan telegrams anew, as after a power cycle.
    pub numbered_anew: Option<u64>,
    /// The number in the first scan telegram that went out to a taker.
    pub first_taken: Option<u16>,
    /// How long in the drive it measured and nobody took scans.
    pub unheard: Option<Duration>,
    /// The same since somebody last took a scan.
    pub silence: Option<Duration>,
    /// What became of connections.
    pub connections: Option<ConnectionCounts>,
    /// Bytes lost because the client of a line did not take them.
    pub bytes_lost: Option<u64>,
    /// What became of datagrams.
    pub datagrams: Option<DatagramCounts>,
}

/// What became of connections in a full house.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ConnectionCounts {
    /// Turned away.
    pub refused: u64,
    /// Closed because not one valid telegram had come.
    pub silent: u64,
    /// Closed because nothing had passed for too long.
    pub idle: u64,
}

impl ScannerCounts {
    /// Scans it has measured and not sent to the client it has. With several clients a scan may count more than once. What a slow host had it miss is none: no
    /// telegram was numbered for that. None where its family does not count them.
    pub fn scans_not_sent(&self) -> Option<u64> {
        Some(self.scans_dropped? + self.scans_unheard?)
    }
}

impl From<EmulatorCounts> for ScannerCounts {
    fn from(counts: EmulatorCounts) -> Self {
        Self {
            scans_sent: counts.scans_sent,
            scans_dropped: Some(counts.scans_dropped),
            scans_kept_by_faults: counts.scans_kept_by_faults,
            scans_missed: Some(counts.scans_missed),
            scans_unheard: Some(counts.scans_unheard),
            last_counter: counts.last_counter,
            numbered_anew: Some(counts.numbered_anew),
            first_taken: counts.first_taken,
            unheard: Some(counts.unheard),
            silence: Some(counts.silence),
            connections: Some(ConnectionCounts {
                refused: counts.connections_refused,
                silent: counts.connections_silent,
                idle: counts.connections_idle,
            }),
            bytes_lost: None,
            datagrams: counts.datagrams,
        }
    }
}

impl From<SerialCounts> for ScannerCounts {
    fn from(counts: SerialCounts) -> Self {
        let SerialCounts { scans_sent, scans_dropped, scans_kept_by_faults, scans_missed, bytes_lost } =
            counts;
        Self {
            scans_sent,
            scans_dropped,
            scans_kept_by_faults,
            scans_missed: Some(scans_missed),
            bytes_lost: Some(bytes_lost),
            ..Self::default()
        }
    }
}

/// Tells what a scanner has done, for as long as anyone asks, and does not keep it running.
#[derive(Clone)]
pub struct CountReader {
    counts: Arc<dyn Fn() -> Option<ScannerCounts> + Send + Sync>,
    clients: Arc<dyn Fn() -> Option<usize> + Send + Sync>,
    taken: Arc<dyn Fn() -> Option<bool> + Send + Sync>,
}

impl CountReader {
    /// Its counts so far; none once it is gone.
    pub fn counts(&self) -> Option<ScannerCounts> {
        (self.counts)()
    }

    /// How many clients are connected; none once it is gone, and of a line, which has one client at most.
    pub fn clients(&self) -> Option<usize> {
        (self.clients)()
    }

    /// Whether somebody takes its scans; none once it is gone, and of a line.
    pub fn is_taken(&self) -> Option<bool> {
        (self.taken)()
    }
}

impl fmt::Debug for CountReader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("CountReader").field(&self.counts()).finish()
    }
}

/// A virtual scanner as a bench has it, whichever family it is of. Dropping it ends it.
pub trait VirtualScanner: fmt::Debug + Send + Sync {
    /// A handle that tells what it has done.
    fn count_reader(&self) -> CountReader;

    /// What a replay has refused because the recorded scans would have to be others.
    fn refused_settings(&self) -> Vec<RefusedSetting>;

    /// What counts as sent and has not left: in its clients' queues, then what faults hold back.
    fn held(&self) -> Vec<InFlight>;

    /// Counts what has not left as dropped: it was sent to nobody.
    fn give_up_held(&self);

    /// What it has done so far.
    fn scanner_counts(&self) -> ScannerCounts {
        self.count_reader().counts().unwrap_or_default()
    }
}

impl VirtualScanner for Emulator {
    fn count_reader(&self) -> CountReader {
        let (counter, clients, taken) = (self.counter(), self.counter(), self.counter());
        CountReader {
            counts: Arc::new(move || counter.counts().map(ScannerCounts::from)),
            clients: Arc::new(move || clients.clients()),
            taken: Arc::new(move || taken.is_taken()),
        }
    }

    fn refused_settings(&self) -> Vec<RefusedSetting> {
        Emulator::refused_settings(self)
    }

    fn held(&self) -> Vec<InFlight> {
        let by_faults = self.shared.config.faults.as_ref().map(StreamFaults::held);
        [&self.shared.in_flight].into_iter().chain(by_faults).cloned().collect()
    }

    fn give_up_held(&self) {
        let by_faults = self.shared.config.faults.as_ref().map_or(0, StreamFaults::give_up);
        self.shared.count_as_dropped(self.shared.in_flight.pending() + by_faults);
    }
}

impl VirtualScanner for SerialEmulator {
    fn count_reader(&self) -> CountReader {
        let counted = self.counting();
        CountReader {
            counts: Arc::new(move || Some(ScannerCounts::from(counted()))),
            clients: Arc::new(|| None),
            taken: Arc::new(|| None),
        }
    }

    fn refused_settings(&self) -> Vec<RefusedSetting> {
        Vec::new()
    }

    fn held(&self) -> Vec<InFlight> {
        SerialEmulator::held(self).into_iter().collect()
    }

    fn give_up_held(&self) {
        SerialEmulator::give_up_held(self);
    }
}
