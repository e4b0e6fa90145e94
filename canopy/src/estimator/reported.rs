//! What the row reports anyway, in the form of measures: for tables that set the estimators side by side.

use super::measure::{Measure, Quantity};
use crate::estimate::{Estimate, TreeEstimate};
use crate::leaf::{Known, Withheld};

/// Names of the estimators that every estimate holds, and what they are.
pub static REPORTED: &[(&str, &str)] = &[
    ("contact", "contact frequency in voxels, times the calibration's factor"),
    ("contact_raw", "contact frequency in voxels, no fitted factor, wood counted as leaf"),
    ("share", "the same by the shares of spots that remission tells, times the calibration's factor"),
    ("share_raw", "shares of spots in voxels, no fitted factor, wood counted as leaf"),
    ("regression", "regression on I_T, by the calibration"),
    ("null", "the calibration rows' mean: the estimate of someone who does not scan"),
];

fn leaf_area(estimator: &'static str, value: Known) -> Measure {
    Measure::new(estimator, Quantity::LeafArea, value.ok())
}

impl Estimate {
    /// The leaf areas every estimate holds, then what the requested estimators measured.
    pub fn side_by_side(&self) -> Vec<Measure> {
        let areas = &self.leaf.areas;
        let calibrated =
            self.calibration.as_ref().map_or(Err(Withheld::Uncalibrated), |_| areas.contact_m2());
        let mut all = vec![
            leaf_area("contact", calibrated),
            leaf_area("contact_raw", areas.contact_raw_m2()),
            leaf_area("regression", areas.regression_m2()),
            Measure::new("null", Quantity::LeafArea, self.leaf.null_m2),
        ];
        // Only where remission is read.
        let shares = [("share", areas.share_m2()), ("share_raw", areas.share_raw_m2())];
        let told = shares.into_iter().filter(|(_, value)| value.is_ok());
        all.extend(told.map(|(name, value)| leaf_area(name, value)));
        all.extend_from_slice(&self.measures);
        all
    }
}

impl TreeEstimate {
    /// The leaf areas every tree's estimate holds, then what the requested estimators measured.
    pub fn side_by_side(&self) -> Vec<Measure> {
        let mut all = vec![
            leaf_area("contact", self.leaf.areas.contact_m2()),
            leaf_area("regression", self.leaf.areas.regression_m2()),
        ];
        all.extend_from_slice(&self.measures);
        all
    }
}
