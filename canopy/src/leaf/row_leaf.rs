//! The leaf area of a whole row: its areas, and how sure they are.

use serde::{Serialize, Serializer};

use super::areas::LeafAreas;
use super::estimator::LeafAreaEstimator;
use super::withheld::Withheld;
use crate::calibration::RegressionKind;
use crate::uncertainty::Uncertainty;

/// The leaf area of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowLeaf {
    /// The areas, each known or withheld.
    pub areas: LeafAreas,
    /// The ends within which the leaf area lies with 95 %, lower and upper, m²: sampling and what other classes would have told. `None` where
    /// nothing tells the row's class, or the row is too short.
    pub interval_m2: Option<[f64; 2]>,
    /// The ends by the row's own sampling alone, m²: what it lies within if the row is of the class that the leaf area holds for.
    pub sampling_error_m2: Option<[f64; 2]>,
    /// What both are made of, relative.
    pub uncertainty: Option<Uncertainty>,
    /// Where the leaf area comes from.
    pub estimator: Option<LeafAreaEstimator>,
    /// Relative standard deviation of the leaf area by what the beams' width was taken out by; 0 for rays and for shares of spots, `None` where their width is not known.
    pub spot_relative_sd: Option<f64>,
    /// The regression used.
    pub regression: Option<RegressionKind>,
    /// What the calibration rows' mean would give: the estimate of someone who does not scan, m².
    pub null_m2: Option<f64>,
}

impl RowLeaf {
    /// Nothing told.
    pub fn withheld(why: Withheld) -> Self {
        Self { areas: LeafAreas::withheld(why), ..Self::default() }
    }
}

/// The keys of a row's leaf area, in their order in files.
#[derive(Serialize)]
struct Keys<'a> {
    leaf_area_m2: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    leaf_area_withheld: Option<Withheld>,
    leaf_area_interval_m2: Option<[f64; 2]>,
    leaf_area_sampling_error_m2: Option<[f64; 2]>,
    leaf_area_uncertainty: &'a Option<Uncertainty>,
    lai: Option<f64>,
    leaf_area_estimator: Option<LeafAreaEstimator>,
    leaf_area_spot_relative_sd: Option<f64>,
    leaf_area_contact_m2: Option<f64>,
    leaf_area_contact_raw_m2: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    leaf_area_share_m2: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    leaf_area_share_raw_m2: Option<f64>,
    leaf_area_regression_m2: Option<f64>,
    regression: Option<RegressionKind>,
    leaf_area_null_m2: Option<f64>,
}

impl Serialize for RowLeaf {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let areas = &self.areas;
        Keys {
            leaf_area_m2: areas.best.ok(),
            leaf_area_withheld: areas.best.err(),
            leaf_area_interval_m2: self.interval_m2,
            leaf_area_sampling_error_m2: self.sampling_error_m2,
            leaf_area_uncertainty: &self.uncertainty,
            lai: areas.lai().ok(),
            leaf_area_estimator: self.estimator,
            leaf_area_spot_relative_sd: self.spot_relative_sd,
            leaf_area_contact_m2: areas.contact.ok(),
            leaf_area_contact_raw_m2: areas.contact_raw.ok(),
            leaf_area_share_m2: areas.share.ok(),
            leaf_area_share_raw_m2: areas.share_raw.ok(),
            leaf_area_regression_m2: areas.regression.ok(),
            regression: self.regression,
            leaf_area_null_m2: self.null_m2,
        }
        .serialize(serializer)
    }
}
