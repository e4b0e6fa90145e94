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

/// Why a call did not give what was asked for. Only its words reach Python, so that every error of our crates is one by `?`.
#[derive(Debug)]
pub(crate) enum Failure {
    /// What could not be done.
    Told(Box<dyn std::error::Error + Send + Sync>),
    /// The user has interrupted.
    Interrupted,
}

impl<E: std::error::Error + Send + Sync + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Told(Box::new(error))
    }
}

/// What the command line has no words for.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Refusal {
    /// An orchard that cannot be grown.
    #[error("the orchard cannot be grown: {0}")]
    Grow(#[source] rowscan_scenes::GrowError),
    /// Scans that fit in no array.
    #[error(
        "scan {scan} has {found} beams and the scans before it {expected}, or other angles: they fit in no array; read up to it with scans={scan}, or its points with `rowscan export --what points`"
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
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Interrupted => PyKeyboardInterrupt::new_err(()),
            Failure::Told(error) => {
                let remedy = rowscan_files::missing_file(&*error).unwrap_or_default();
                Error::new_err(format!("{error}{remedy}"))
            }
        }
    }
}

impl From<Refusal> for PyErr {
    fn from(refusal: Refusal) -> Self {
        Failure::from(refusal).into()
    }
}
