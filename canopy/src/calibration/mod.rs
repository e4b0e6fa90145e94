//! A calibration: how impacted area, and contact frequency, become leaf area, for one class of orchard and scanner.
//!
//! The reference length is a metre of row: every fit is made on values per metre.
//! - linear: L = a · length + b · I_T. A cell without returns is a gap and holds 0, never `a`.
//! - power: L / length = c · (I_T / length)^p.
//! - contact: L / length = k · (x − w)^p with x, the raw contact-frequency leaf area a metre, and w, the wood that is taken out. Without w, k and p hold the
//!   wood; they hold clumping and the leaves' true projection in any case.
//! - share: the same where hits count by the shares of spots that remission tells.
//!
//! A calibration is valid for its [`CalibrationClass`] only. Within it, an estimate outside the fitted range carries a warning, and
//! one far outside (a factor [`FAR`] beyond either end) is withheld.

pub(crate) mod canopy;
pub(crate) mod contact_scale;
pub(crate) mod error;
mod fit;
pub(crate) mod model;
mod quality;
mod witness;
pub(crate) mod wood;

pub use canopy::CanopyClass;
pub use contact_scale::{ClumpingBy, ContactScale, FittedRows};
pub use error::CalibrationError;
pub use fit::{FitError, MIN_SAMPLES, Sample, fit};
pub use model::{
    Calibration, CalibrationClass, EchoRule, Linear, Optics, Power, Provenance, RegressionKind, Training,
    Units,
};
pub use quality::{FAR, FitQuality, FittedRange};
pub use witness::Witness;
pub use wood::Wood;
