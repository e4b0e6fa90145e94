//! The impacted areas of a scan.

use serde::{Deserialize, Serialize};

/// Leaves of a beam that I_3L counts (the paper's "three outer layers").
pub const LAYERS: usize = 3;

/// |beam · leaf normal| below which a leaf's visible area is counted as if it were this: a leaf seen edge-on would count without bound.
pub const LEAST_INCIDENCE: f64 = 0.02;

/// What a scan adds up to, m². I_T, I_L and I_3L are sums (paper eq. 4) of projections (eq. 3 and its counterparts): on the YZ plane for lateral scans,
/// on the ground for zenith scans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ScanAreas {
    /// I_L: beams that met a leaf first.
    #[serde(rename = "I_L")]
    pub leaf_m2: f64,
    /// I_T: beams that met a leaf or wood first.
    #[serde(rename = "I_T")]
    pub total_m2: f64,
    /// I_3L: up to three distinct leaves of every beam before the first wood, each at its own range.
    #[serde(rename = "I_3L")]
    pub three_leaves_m2: f64,
    /// One-sided leaf area in sight: I_L's beams, each divided by its incidence instead of projected. Needs normals, so simulation.
    pub visible_leaf_area_m2: f64,
}

impl std::ops::AddAssign for ScanAreas {
    fn add_assign(&mut self, other: Self) {
        self.leaf_m2 += other.leaf_m2;
        self.total_m2 += other.total_m2;
        self.three_leaves_m2 += other.three_leaves_m2;
        self.visible_leaf_area_m2 += other.visible_leaf_area_m2;
    }
}

impl std::iter::Sum for ScanAreas {
    fn sum<I: Iterator<Item = Self>>(items: I) -> Self {
        items.fold(Self::default(), |mut sum, item| {
            sum += item;
            sum
        })
    }
}
