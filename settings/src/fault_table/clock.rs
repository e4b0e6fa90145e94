//! Faults of a scanner's clock.

/// A fault of a scanner's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClockFault {
    /// Too fast by so many parts per million.
    Drift {
        /// How much.
        ppm: f64,
    },
    /// Set forward by so many seconds, or back.
    Step {
        /// How far.
        s: f64,
    },
    /// The next stamp of scans begins at 0 again.
    Wrap,
}
