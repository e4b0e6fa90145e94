//! The canopy by metre: what was measured, and what stands there.

use serde::Serialize;

/// The canopy along the row, as far as it is known.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Strip {
    /// What stands there, along one period of the row; empty where nobody knows.
    pub truth: Vec<TruthColumn>,
    /// The row repeats after so many metres; none where it does not.
    pub period_m: Option<f64>,
    /// Where the lowest band of [`TruthColumn::leaf_area_m2`] begins, above the ground: metres. Crowns begin above bare trunks.
    pub z_from_m: f64,
    /// Height of a band, metres.
    pub band_m: f64,
    /// What was measured, by scanner: metre by metre.
    pub measured: Vec<Vec<Metre>>,
}

/// What stands in one piece of the row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TruthColumn {
    /// Along the row.
    pub y_from_m: f64,
    /// To here.
    pub y_to_m: f64,
    /// One-sided leaf area by height band, the lowest first.
    pub leaf_area_m2: Vec<f64>,
}

/// What was measured of one metre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Metre {
    /// Along the row.
    pub y_from_m: f64,
    /// To here.
    pub y_to_m: f64,
    /// How much of it has been scanned.
    pub scanned_m: f64,
    /// Impacted total area.
    pub impacted_m2: Option<f64>,
    /// Leaf area by the calibration.
    pub leaf_area_m2: Option<f64>,
}
