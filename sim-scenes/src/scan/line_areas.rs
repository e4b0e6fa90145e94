//! From what the beams of a scan met to its impacted areas.

use super::areas::{LAYERS, LEAST_INCIDENCE, ScanAreas};
use super::plan::ScanPlan;
use super::wood::Casts;
use crate::caster::{Class, Layers};

impl ScanPlan {
    /// The areas of one line, of the plan's target only.
    pub fn line_areas(&self, layers: &Layers) -> ScanAreas {
        let mut areas = ScanAreas::default();
        for (beam, nearest) in layers.nearest().iter().enumerate() {
            if !self.counts(nearest) {
                continue;
            }
            let patch = self.patch_m2(beam, nearest.range_m);
            areas.total_m2 += patch;
            if nearest.class == Class::Leaf {
                areas.leaf_m2 += patch;
                let incidence = f64::from(nearest.cos_incidence).max(LEAST_INCIDENCE);
                areas.visible_leaf_area_m2 += self.square_patch_m2(nearest.range_m) / incidence;
                // Every first leaf is counted, so that I_L never exceeds I_3L by rounding.
                areas.three_leaves_m2 += patch;
            }
            for leaf in layers.leaves(beam).iter().take(LAYERS).skip(1).filter(|leaf| self.counts(leaf)) {
                areas.three_leaves_m2 += self.patch_m2(beam, leaf.range_m);
            }
        }
        areas
    }

    /// Casts the whole scan and adds it up, in the order of the lines: the same bits on any number of threads.
    pub fn areas(&self, caster: &dyn Casts) -> ScanAreas {
        self.lines(caster, LAYERS, |line| self.line_areas(line.layers)).into_iter().sum()
    }
}
