//! Estimators fitted on the rows of one class.

use rowscan_canopy::calibration::{CalibrationClass, EchoRule, Optics, Provenance};
use rowscan_canopy::regression::{FittedLine, mean};
use rowscan_canopy::{Calibration, CanopyClass, Sample, fit};

use super::{DENSITIES, TransferRow};

/// Every estimator that a class's rows calibrate.
#[derive(Clone, Debug)]
pub(super) struct Fits {
    /// By density.
    factors: [Option<f64>; 4],
    regression: Option<Calibration>,
    null_m2_per_m: f64,
}

/// The estimators, in the order of the tables. `contact_raw` needs no fit.
pub(super) const ESTIMATORS: [&str; 7] =
    ["contact_raw", DENSITIES[0], DENSITIES[1], DENSITIES[2], DENSITIES[3], "regression", "null"];

impl Fits {
    /// On these rows. A fit that they do not allow is left out.
    pub(super) fn on<'a>(rows: impl Iterator<Item = &'a TransferRow> + Clone) -> Self {
        let usable = rows.filter(|row| row.truth_m2 > 0.0 && row.canopy_m > 0.0);
        let factor = |density: usize| {
            let known = usable.clone().filter_map(|row| {
                let raw_m2 = row.densities_m2.get(density).copied().flatten()?;
                Some((raw_m2 / row.canopy_m, row.truth_m2 / row.canopy_m))
            });
            let (x, y): (Vec<f64>, Vec<f64>) = known.unzip();
            FittedLine::through_origin(&x, &y).map(|line| line.slope)
        };
        let sample = |row: &TransferRow| Sample {
            length_m: row.canopy_m,
            impacted_total_area_m2: row.impacted_m2,
            contact_leaf_area_m2: row.densities_m2[0].unwrap_or(0.0),
            leaf_area_m2: row.truth_m2,
            ..Sample::default()
        };
        let samples: Vec<Sample> = usable.clone().map(sample).collect();
        let per_metre: Vec<f64> = usable.clone().map(|row| row.truth_m2 / row.canopy_m).collect();
        Self {
            factors: [0, 1, 2, 3].map(factor),
            regression: fit(&samples, class(), Provenance::default()).ok(),
            null_m2_per_m: mean(&per_metre),
        }
    }

    /// What an estimator says of a row.
    pub(super) fn leaf_area_m2(&self, estimator: &str, row: &TransferRow) -> Option<f64> {
        match estimator {
            "contact_raw" => row.densities_m2[0],
            "null" => Some(self.null_m2_per_m * row.canopy_m),
            "regression" => {
                let calibration = self.regression.as_ref()?;
                let kind = calibration.best_regression();
                Some(calibration.regression_m2(kind, row.canopy_m, row.impacted_m2))
            }
            density => {
                let number = DENSITIES.iter().position(|name| *name == density)?;
                Some(
                    self.factors.get(number).copied().flatten()?
                        * row.densities_m2.get(number).copied().flatten()?,
                )
            }
        }
    }
}

/// A class for fits that are not kept.
fn class() -> CalibrationClass {
    CalibrationClass {
        preset: "study".to_owned(),
        shady_threshold_percent: 101.0,
        growth_stage: "study".to_owned(),
        tree_spacing_m: 1.0,
        scanner_model: "study".to_owned(),
        resolution_deg: 1.0,
        echo_rule: EchoRule::First,
        optics: Optics::Ideal,
        distance_m: None,
        height_m: None,
        yaw_deg: None,
        pitch_deg: None,
        line_spacing_m: None,
        crown_depth_m: None,
        voxel_m: None,
        canopy: CanopyClass::default(),
    }
}
