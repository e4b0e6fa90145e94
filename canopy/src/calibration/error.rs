//! Why a calibration cannot be used.

/// Why a calibration cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// A coefficient is not a finite number.
    #[error("calibration: {key} must be a finite number, found {value}")]
    NotFinite {
        /// The key, with its table.
        key: &'static str,
        /// The value found.
        value: f64,
    },
    /// A range or scale that must be positive is not.
    #[error("calibration: {key} must be positive, found {value}")]
    NotPositive {
        /// The key, with its table.
        key: &'static str,
        /// The value found.
        value: f64,
    },
    /// A text of the class is empty.
    #[error("calibration: {key} is empty; a calibration holds for its class only")]
    EmptyClass {
        /// The key, with its table.
        key: &'static str,
    },
}
