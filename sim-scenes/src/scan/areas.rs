//! The impacted areas of a scan.

use serde::{Deserialize, Serialize};

use super::plan::ScanPlan;
use super::{LAYERS, LEAST_INCIDENCE};
use crate::caster::{Class, Layers};

/// What a scan adds up to, m². I_T, I_L and I_3L are projections (paper eq. 3 and its counterparts): on the YZ plane for lateral scans,
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

impl ScanAreas {
    /// The areas of one line, of the plan's target only.
    pub(super) fn of_line(plan: &ScanPlan, layers: &Layers) -> Self {
        let mut areas = Self::default();
        for (beam, nearest) in layers.nearest().iter().enumerate() {
            if !plan.counts(nearest) {
                continue;
            }
            let patch = plan.patch_m2(beam, nearest.range_m);
            areas.total_m2 += patch;
            if nearest.class == Class::Leaf {
                areas.leaf_m2 += patch;
                let incidence = f64::from(nearest.cos_incidence).max(LEAST_INCIDENCE);
                areas.visible_leaf_area_m2 += plan.square_patch_m2(nearest.range_m) / incidence;
                // Every first leaf is counted, so that I_L never exceeds I_3L by rounding.
                areas.three_leaves_m2 += patch;
            }
            for leaf in layers.leaves(beam).iter().take(LAYERS).skip(1).filter(|leaf| plan.counts(leaf)) {
                areas.three_leaves_m2 += plan.patch_m2(beam, leaf.range_m);
            }
        }
        areas
    }
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
