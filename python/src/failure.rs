//! What went wrong, in the command line's words.

use std::time::Duration;

use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;

pyo3::create_exception!(
    rowscan,
    Error,
    PyValueError,
    "What rowscan could not do. Its text is that of the command line: what was expected, what was found, and the remedy."
);

/// Why a call did not give what was asked for.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// A scene or rig.
    #[error(transparent)]
    Load(#[from] rowscan_scenes::files::LoadError),
    /// A name that is no scanner model.
    #[error(transparent)]
    Model(#[from] rowscan_protocol::model::UnknownModel),
    /// Optics that are none.
    #[error(transparent)]
    Optics(#[from] rowscan_scenes::optics::StagesError),
    /// An orchard that cannot be grown.
    #[error("the orchard cannot be grown: {0}")]
    Grow(#[from] rowscan_scenes::GrowError),
    /// A scanner that does not fit the rig.
    #[error(transparent)]
    Stage(#[from] rowscan_emulator::stage::StageError),
    /// A drive in memory.
    #[error(transparent)]
    Trial(#[from] rowscan_study::trial::TrialError),
    /// A row that cannot be scanned so.
    #[error(transparent)]
    RowScan(#[from] rowscan_study::row_scan::RowScanError),
    /// A rig that allows no estimate.
    #[error(transparent)]
    Reading(#[from] rowscan_study::reading::ReadingError),
    /// A scanner or a recording.
    #[error(transparent)]
    Driver(#[from] rowscan_driver::DriverError),
    /// An endpoint.
    #[error(transparent)]
    Listen(#[from] rowscan_emulator::ListenError),
    /// A serial line.
    #[error(transparent)]
    SerialLine(#[from] rowscan_ports::PortError),
    /// A port of the CAN bus.
    #[error(transparent)]
    Bus(#[from] rowscan_bus::BusError),
    /// A place for GNSS sentences.
    #[error(transparent)]
    Nmea(#[from] rowscan_bus::nmea::NmeaError),
    /// A fault that does not fit.
    #[error(transparent)]
    Fault(#[from] rowscan_faults::FaultError),
    /// A fault's words.
    #[error(transparent)]
    FaultWords(#[from] rowscan_strict_toml::TomlError),
    /// A port of the CAN bus that is none.
    #[error(transparent)]
    BusAddress(#[from] rowscan_bus::BusAddressError),
    /// A place for sentences that is none.
    #[error(transparent)]
    NmeaAddress(#[from] rowscan_bus::nmea::NmeaAddressError),
    /// A pace that is none.
    #[error(transparent)]
    TimeScale(#[from] rowscan_emulator::clock::TimeScaleError),
    /// A start that is none.
    #[error(transparent)]
    StartWhen(#[from] rowscan_emulator::StartWhenError),
    /// Scans that fit in no array.
    #[error(
        "scan {scan} has {found} beams and the scans before it {expected}: they fit in no array; read up to it with scans={scan}"
    )]
    OtherBeams {
        /// Number of the scan, from 0.
        scan: usize,
        /// Its beams.
        found: usize,
        /// The others'.
        expected: usize,
    },
    /// Seed or optics of an orchard that has its own.
    #[error("an orchard that is grown has its seed and optics: give them to Orchard(…)")]
    AlreadyGrown,
    /// Arguments that do not go together.
    #[error("{0}")]
    Usage(String),
    /// A scanner that is not running.
    #[error("the scanner is not running; call start(), or use it in a `with` block")]
    NotRunning,
    /// Time did not come as far as it was to.
    #[error(
        "time did not come to {what} within {patience:?}: it runs while a client takes scans; connect one, or give a longer `timeout`"
    )]
    Overdue {
        /// Where it was to come to.
        what: String,
        /// How long it was waited for.
        patience: Duration,
    },
    /// Time is past where it was to come to.
    #[error(
        "the tractor is past {what} already, at {row_m:.2} m of the row; stop time with pause() before a client takes scans, or start anew"
    )]
    Past {
        /// Where it was to come to.
        what: String,
        /// Where it is.
        row_m: f64,
    },
    /// The system refused something basic.
    #[error("cannot {what}: {cause}")]
    System {
        /// What was tried.
        what: &'static str,
        /// What the system said.
        cause: std::io::Error,
    },
    /// The user has interrupted.
    #[error("interrupted")]
    Interrupted,
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Interrupted => PyKeyboardInterrupt::new_err(()),
            failure => Error::new_err(failure.to_string()),
        }
    }
}
