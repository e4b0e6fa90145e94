//! The canopy that a calibration was made on, in what changes the leaf area that a scanner sees.

use serde::{Deserialize, Serialize};

/// A canopy by what changes the leaf area that a scanner sees. `None` is unknown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CanopyClass {
    /// Inclination of the leaves from the horizontal, degrees: mean weighted by area.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leaf_angle_deg: Option<f64>,
    /// Mean one-sided area of a leaf, cm².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leaf_area_cm2: Option<f64>,
    /// Season, by the names a scene file has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub season: Option<String>,
    /// What made the trees: a generator's name, or `real`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub generator: Option<String>,
    /// Share of all surface that stops beams and is no leaf: lateral surface of wood, posts and wires, and fruit, over that and both faces of the leaves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wood_share: Option<f64>,
}

impl CanopyClass {
    /// True if nothing is told of it, as in calibrations of older versions.
    pub fn is_unknown(&self) -> bool {
        *self == Self::default()
    }
}
