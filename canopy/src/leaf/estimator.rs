//! Where a leaf area comes from.

use serde::Serialize;

/// Where `leaf_area_m2` comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LeafAreaEstimator {
    /// Contact frequency by the calibration's power law.
    ContactCalibrated,
    /// Contact frequency without a fitted factor.
    ContactRaw,
    /// The calibrated one, the width of the scanner's beams taken out.
    ContactCalibratedSpotCorrected,
    /// The raw one, the width of the scanner's beams taken out.
    ContactRawSpotCorrected,
    /// Shares of spots by the calibration's power law.
    ShareCalibrated,
}
