//! What the row reports anyway, in the form of measures: for tables that set the estimators side by side.

use super::measure::{Measure, Quantity};
use crate::estimate::{Estimate, TreeEstimate};

/// Names of the estimators that every estimate holds, and what they are.
pub static REPORTED: &[(&str, &str)] = &[
    ("contact", "contact frequency in voxels, times the calibration's factor"),
    ("contact_raw", "contact frequency in voxels, no fitted factor, wood counted as leaf"),
    ("share", "the same by the shares of spots that remission tells, times the calibration's factor"),
    ("share_raw", "shares of spots in voxels, no fitted factor, wood counted as leaf"),
    ("regression", "regression on I_T, by the calibration"),
    ("null", "the calibration rows' mean: the estimate of someone who does not scan"),
];

fn leaf_area(estimator: &'static str, value: Option<f64>) -> Measure {
    Measure::new(estimator, Quantity::LeafArea, value)
}

impl Estimate {
    /// The leaf areas every estimate holds, then what the requested estimators measured.
    pub fn side_by_side(&self) -> Vec<Measure> {
        let calibrated = self.leaf_area_contact_m2.filter(|_| self.calibration.is_some());
        let mut all = vec![
            leaf_area("contact", calibrated),
            leaf_area("contact_raw", self.leaf_area_contact_raw_m2),
            leaf_area("regression", self.leaf_area_regression_m2),
            leaf_area("null", self.leaf_area_null_m2),
        ];
        // Only where remission is read.
        let shares = [("share", self.leaf_area_share_m2), ("share_raw", self.leaf_area_share_raw_m2)];
        all.extend(
            shares
                .into_iter()
                .filter(|(_, value)| value.is_some())
                .map(|(name, value)| leaf_area(name, value)),
        );
        all.extend_from_slice(&self.measures);
        all
    }
}

impl TreeEstimate {
    /// The leaf areas every tree's estimate holds, then what the requested estimators measured.
    pub fn side_by_side(&self) -> Vec<Measure> {
        let mut all = vec![
            leaf_area("contact", self.leaf_area_contact_m2),
            leaf_area("regression", self.leaf_area_regression_m2),
        ];
        all.extend_from_slice(&self.measures);
        all
    }
}
