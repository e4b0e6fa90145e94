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
    /// Wood is all of what the thinnest fitted row had, or more.
    #[error("calibration: {key} must be below the fitted range, which begins at {low} m²/m, found {wood}")]
    MostlyWood {
        /// The key, with its table.
        key: &'static str,
        /// The value found.
        wood: f64,
        /// Lowest raw leaf area a metre that was fitted.
        low: f64,
    },
    /// A text of the class is empty.
    #[error("calibration: {key} is empty; a calibration holds for its class only")]
    EmptyClass {
        /// The key, with its table.
        key: &'static str,
    },
}
