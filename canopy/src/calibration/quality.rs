//! How good a fit is, and where a value stands against what was fitted.

use serde::{Deserialize, Serialize};

use super::error::CalibrationError;

/// How far beyond either end of the fitted range an estimate is withheld: a factor.
pub const FAR: f64 = 2.0;

/// How good a fit is, in leaf area per metre of row, whatever it was fitted in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitQuality {
    /// Rows fitted.
    pub n: u32,
    /// 1 − SSE / Σ(L − mean)².
    pub r2: f64,
    /// 1 − SSE / ΣL².
    pub r2_uncentred: f64,
    /// Root mean square of the leave-one-out errors over the mean leaf area.
    pub loo_rmse_relative: f64,
    /// Smallest regressor value fitted, m² a metre of row.
    pub low_m2_per_m: f64,
    /// Largest.
    pub high_m2_per_m: f64,
}

/// Where a value stands against the fitted range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FittedRange {
    /// In the fitted range.
    Inside,
    /// Outside it, by less than a factor [`FAR`].
    Outside,
    /// Far outside: no estimate.
    FarOutside,
}

/// The names of a fit's values in a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct QualityKeys {
    pub(super) n: &'static str,
    pub(super) r2: &'static str,
    pub(super) r2_uncentred: &'static str,
    pub(super) loo: &'static str,
    pub(super) high: &'static str,
}

macro_rules! quality_keys {
    ($table:literal) => {
        QualityKeys {
            n: concat!($table, ".quality.n"),
            r2: concat!($table, ".quality.r2"),
            r2_uncentred: concat!($table, ".quality.r2_uncentred"),
            loo: concat!($table, ".quality.loo_rmse_relative"),
            high: concat!($table, ".quality.high_m2_per_m"),
        }
    };
}
pub(super) use quality_keys;

impl FitQuality {
    /// Refuses what no fit has.
    pub(super) fn validate(&self, keys: &QualityKeys) -> Result<(), CalibrationError> {
        let Self { n, r2, r2_uncentred, loo_rmse_relative, low_m2_per_m, high_m2_per_m } = *self;
        for (key, is_possible, expected, value) in [
            (keys.n, n > 0, "1 row or more", f64::from(n)),
            (keys.r2, r2 <= 1.0, "at most 1", r2),
            (keys.r2_uncentred, r2_uncentred <= 1.0, "at most 1", r2_uncentred),
            (keys.loo, loo_rmse_relative >= 0.0, "0 or more", loo_rmse_relative),
            (keys.high, high_m2_per_m >= low_m2_per_m, "at least low_m2_per_m", high_m2_per_m),
        ] {
            if !is_possible {
                return Err(CalibrationError::OutOfRange { key, expected, value });
            }
        }
        Ok(())
    }

    /// 1 − Σ(leave-one-out error)² / Σ(L − mean)²: how much of what rows differ by is told of rows that were not fitted. Follows from the other three, for
    /// SSE / ΣL² over SSE / Σ(L − mean)² says how large the scatter of L is beside its mean.
    pub fn r2_left_out(&self) -> f64 {
        // Of a fit without error the other two tell no scatter.
        if self.loo_rmse_relative < 1e-6 {
            return 1.0;
        }
        let scatter = (1.0 - self.r2_uncentred) / (1.0 - self.r2);
        1.0 - self.loo_rmse_relative.powi(2) * (1.0 - scatter) / scatter
    }

    /// Where a value per metre of row stands against the fitted range.
    pub fn range(&self, value_m2_per_m: f64) -> FittedRange {
        if value_m2_per_m > self.high_m2_per_m * FAR || value_m2_per_m < self.low_m2_per_m / FAR {
            FittedRange::FarOutside
        } else if value_m2_per_m > self.high_m2_per_m || value_m2_per_m < self.low_m2_per_m {
            FittedRange::Outside
        } else {
            FittedRange::Inside
        }
    }
}
