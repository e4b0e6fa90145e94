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
    /// A value lies where no fit puts one.
    #[error(
        "calibration: {key} must be {expected}, found {value}; it was changed, or belongs to another file: make the calibration again"
    )]
    OutOfRange {
        /// The key, with its table.
        key: &'static str,
        /// What it may be.
        expected: &'static str,
        /// The value found.
        value: f64,
    },
    /// The law tells another leaf area than that of the rows it was fitted on.
    #[error(
        "calibration: {key} tells {told:.2} m² a metre of the mean of the fitted rows, which have {fitted:.2}; the one or the other was changed: make the calibration again"
    )]
    OtherRows {
        /// The factor, with its table.
        key: &'static str,
        /// What the law tells of their mean, m²/m.
        told: f64,
        /// Their mean leaf area, m²/m.
        fitted: f64,
    },
    /// The file is not as it was made.
    #[error(
        "calibration: its values are not those it was made with: its fingerprint is {written}, theirs is {found}; make it again (`provenance.command`), or, \
         where the values are your own, take the line `fingerprint` out"
    )]
    Changed {
        /// As it stands in the file.
        written: String,
        /// Of the values.
        found: String,
    },
    /// A text of the class is empty.
    #[error("calibration: {key} is empty; a calibration holds for its class only")]
    EmptyClass {
        /// The key, with its table.
        key: &'static str,
    },
}
