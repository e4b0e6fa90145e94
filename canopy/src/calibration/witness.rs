//! How shares of spots and contact agree on the rows of a calibration.
//!
//! Shares follow all that changes power: a dirty window, wet or darker leaves, a card that was misread. Contact does not. So a row whose shares agree with its
//! contact otherwise than the calibration's rows did is not measured by shares.

use serde::{Deserialize, Serialize};

use super::contact_scale::ContactScale;
use super::error::CalibrationError;
use crate::regression::{FittedLine, mean, student_t_99};

/// What shares say over what contact says, both raw: ratio · (x / mean)^exponent, with x the raw contact leaf area a metre. Rows scatter about it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Witness {
    /// Rows.
    pub n: u32,
    /// Their mean length with canopy, metres: shorter stretches scatter more.
    pub row_m: f64,
    /// Geometric mean of their raw contact leaf areas a metre, m²/m.
    pub mean_m2_per_m: f64,
    /// The ratio of rows of that leaf area, in the median.
    pub ratio: f64,
    /// By which power of the leaf area the ratio grows.
    pub exponent: f64,
    /// Standard deviation of the logarithm of the rows' ratios about this law.
    pub sd: f64,
}

/// Fewest rows that tell how ratios scatter.
const LEAST_ROWS: usize = 8;

/// Smallest standard deviation that counts: two estimators of one row do not agree better.
const LEAST_SD: f64 = 0.02;

impl Witness {
    /// Of rows: length with canopy, m, and raw leaf areas a metre by contact and by shares. `None` for too few rows.
    pub(super) fn of(length_m: &[f64], contact: &[f64], share: &[f64]) -> Option<Self> {
        if contact.len() < LEAST_ROWS {
            return None;
        }
        let ln_x: Vec<f64> = contact.iter().map(|x| x.ln()).collect();
        let ln_ratio: Vec<f64> =
            share.iter().zip(contact).map(|(share, contact)| (share / contact).ln()).collect();
        let (mean_x, mean_ratio) = (mean(&ln_x), mean(&ln_ratio));
        let exponent = FittedLine::fit(&ln_x, &ln_ratio).map_or(0.0, |line| line.slope);
        let squares: f64 =
            ln_x.iter().zip(&ln_ratio).map(|(x, y)| (y - mean_ratio - exponent * (x - mean_x)).powi(2)).sum();
        Some(Self {
            n: u32::try_from(contact.len()).unwrap_or(u32::MAX),
            row_m: mean(length_m),
            mean_m2_per_m: mean_x.exp(),
            ratio: mean_ratio.exp(),
            exponent,
            sd: (squares / (contact.len() - 2) as f64).sqrt(),
        })
    }

    /// The ratios that 99 of 100 rows of so much canopy have, lower and upper end. Densities beyond those that contact was fitted on count as that of the end.
    pub fn band(&self, contact: &ContactScale, raw_m2_per_m: f64, length_m: f64) -> [f64; 2] {
        let x = raw_m2_per_m.min(contact.quality.high_m2_per_m).max(contact.quality.low_m2_per_m);
        let middle = self.ratio * (x / self.mean_m2_per_m).powf(self.exponent);
        let n = f64::from(self.n);
        let shorter = (self.row_m / length_m).max(1.0);
        let sd = self.sd.max(LEAST_SD) * (shorter + 1.0 / n).sqrt();
        let reach = (student_t_99(n - 2.0) * sd).exp();
        [middle / reach, middle * reach]
    }

    /// Refuses values that no row could be held against.
    pub(super) fn validate(&self) -> Result<(), CalibrationError> {
        for (key, value) in [
            ("witness.n", f64::from(self.n) - 2.0),
            ("witness.row_m", self.row_m),
            ("witness.mean_m2_per_m", self.mean_m2_per_m),
            ("witness.ratio", self.ratio),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(CalibrationError::NotPositive { key, value });
            }
        }
        for (key, value) in [("witness.exponent", self.exponent), ("witness.sd", self.sd)] {
            if !value.is_finite() {
                return Err(CalibrationError::NotFinite { key, value });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::{ClumpingBy, FitQuality};

    fn contact() -> ContactScale {
        let quality = FitQuality {
            n: 60,
            r2: 0.7,
            r2_uncentred: 0.98,
            loo_rmse_relative: 0.15,
            low_m2_per_m: 2.0,
            high_m2_per_m: 8.0,
        };
        ContactScale {
            k: 1.0,
            p: 1.0,
            fitted: None,
            k_sd: None,
            clumping: ClumpingBy::Constant,
            wood: None,
            quality,
        }
    }

    /// Rows of ratio 1.1 · (x / 4)^0.2, each off by one of two factors.
    fn rows(n: usize, off: f64) -> Witness {
        let x: Vec<f64> = (0..n).map(|i| 4.0 * (0.5 * (i as f64 / n as f64 - 0.5)).exp()).collect();
        let share: Vec<f64> = x
            .iter()
            .enumerate()
            .map(|(i, x)| x * 1.1 * (x / 4.0).powf(0.2) * off.powi(if i % 2 == 0 { 1 } else { -1 }))
            .collect();
        Witness::of(&vec![18.0; n], &x, &share).expect("a witness")
    }

    #[test]
    fn the_law_of_the_rows_is_found_and_its_band_holds_99_of_100() {
        let witness = rows(60, 1.05);
        assert!((witness.exponent - 0.2).abs() < 0.03, "{witness:?}");
        assert!(
            (witness.ratio / 1.1).ln().abs() < 0.01 && (witness.sd - 1.05_f64.ln()).abs() < 0.002,
            "{witness:?}"
        );
        let [low, high] = witness.band(&contact(), 4.0, 18.0);
        // Student's t of 58 degrees of freedom is 2.663.
        let sd = (high / low).ln() / 2.0 / (1.0 + 1.0_f64 / 60.0).sqrt() / witness.sd;
        assert!((sd - 2.663).abs() < 0.01, "{sd}");
        assert!(low < 1.1 && 1.1 < high);
    }

    #[test]
    fn short_stretches_scatter_more_and_densities_beyond_the_fitted_ones_are_not_followed() {
        let witness = rows(60, 1.05);
        let width = |length_m| {
            let [low, high] = witness.band(&contact(), 4.0, length_m);
            (high / low).ln()
        };
        assert_eq!(width(18.0), width(40.0));
        assert!((1.9..2.1).contains(&(width(4.5) / width(18.0))));
        assert_eq!(witness.band(&contact(), 8.0, 18.0), witness.band(&contact(), 30.0, 18.0));
    }

    #[test]
    fn few_rows_are_no_witness_and_rows_that_agree_exactly_still_leave_room() {
        assert_eq!(Witness::of(&[18.0; 7], &[4.0; 7], &[4.4; 7]), None);
        let [low, high] = rows(20, 1.0).band(&contact(), 4.0, 18.0);
        assert!(low < 1.08 && high > 1.12, "{low} {high}");
    }
}
