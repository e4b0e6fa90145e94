//! Whether the ground and the row lie where the rig has them, as far as the scans tell.

use super::{Row, Totals};
use crate::across::{Faces, Growth};
use crate::answers::Answers;
use crate::contact::Sampled;
use crate::ground_line::OtherSlope;
use crate::level::{FAR_BELOW_M, LEAST_CANOPY, LevelSurface};

/// Share of the row's room that no beam leads to from which on the row is not seen.
const OUT_OF_SIGHT: f64 = 0.55;
/// The same of the crown's height from below: a scanner that looks up at 1.3 m reads a spindle 29 % low, one at 1 m 12 %.
const LOW_OUT_OF_SIGHT: f64 = 0.15;
/// Trunks without leaves are so high, metres.
const TRUNK_M: f64 = 0.5;
/// Of a canopy of which less is hidden the leaf area hangs little on the axis: see-through rows, of small trees that lean over to one side. An axis that is
/// 0.3 m off costs 4 % below a tenth, 15 % at this, and half the leaf area and more where a half is hidden.
const MOST_HIDDEN: f64 = 0.2;
/// A far face so near to the gate may be that gate's, metres.
const NEAR_GATE_M: f64 = 0.2;
/// Leaf area index, raw, that no orchard has: dense ones have 6, and read up to twice as much.
const MOST_LEAVES: f64 = 18.0;

impl Row {
    /// The ground, where it lies among what counts as canopy: a level surface, and no ground where the rig puts it; or a part of what lies where the ground was
    /// found.
    pub(crate) fn ground_in_canopy(&self) -> Option<LevelSurface> {
        let mistaken = self.levels.mistaken_ground(self.totals.returns.ground, &self.table, &self.frame);
        mistaken.or_else(|| self.ground.in_canopy())
    }

    /// Share of the returns above grass that the rig's clearance takes for ground, where it is more than a few.
    pub(crate) fn cut_by_clearance(&self) -> Option<f64> {
        self.levels.cut()
    }

    /// True where the ground lies so far below where the rig has it that leaves count as ground.
    pub(crate) fn takes_leaves_for_ground(&self) -> bool {
        self.other_level_m().is_some_and(|level_m| level_m < -FAR_BELOW_M)
    }

    /// Share of the returns that lie far below where the rig has the ground, where it is more than ground can have there.
    pub(crate) fn below_ground(&self) -> Option<f64> {
        self.levels.below_ground(self.totals.returns.ground)
    }

    /// Share of the beams that met something, of those that the rig leads to the ground before the row, where hardly one did.
    pub(crate) fn silent_ground(&self) -> Option<f64> {
        let tells = self.totals.returns.canopy >= LEAST_CANOPY;
        tells.then(|| self.answers.silent_ground(&self.table, &self.frame)).flatten()
    }

    /// Share of the returns that lie where the rig puts the ground, where there are next to none though it leads beams to the alley.
    pub(crate) fn unmet_ground(&self) -> Option<f64> {
        let share = self.levels.no_ground(self.totals.returns.ground);
        share.filter(|_| Answers::leads_to_alley(&self.table, &self.frame))
    }

    /// Share of the row that no beam leads to, where it is so much that the row is not seen: of its room, whatever stands there, or of the crown's height from
    /// below.
    pub(crate) fn out_of_sight(&self) -> Option<f64> {
        let room = Some(self.voxels.out_of_sight()).filter(|share| *share > OUT_OF_SIGHT);
        let low = || {
            let top_m = self.levels.top_m()?;
            let share = (self.voxels.lowest_in_sight_m() - TRUNK_M) / (top_m - TRUNK_M).max(TRUNK_M);
            Some(share.min(1.0)).filter(|share| *share > LOW_OUT_OF_SIGHT)
        };
        room.or_else(low)
    }

    /// The canopy's faces, where they do not lie about the rig's row axis, and that matters: much is hidden and would be taken for its mirror image, or lies
    /// beyond the voxels or the gate to the next row.
    pub(crate) fn elsewhere(&self, totals: &Totals, sampled: &Sampled) -> Option<Faces> {
        let beyond = 1.0 - totals.hits as f64 / totals.returns.canopy.max(1) as f64;
        let matters = sampled.hidden() > MOST_HIDDEN || beyond > MOST_HIDDEN;
        // What reaches the middle between the rows may have been taken for the next one's.
        let gate_m = self.frame.far_gate_m - self.frame.distance_m - NEAR_GATE_M;
        self.across.elsewhere().filter(|faces| matters || faces.far_m > gate_m)
    }

    /// Grass and weeds in the alley; `None` where they are few.
    pub(crate) fn growth_in_alley(&self) -> Option<Growth> {
        self.across.growth_in_alley()
    }

    /// How deep across the row the canopy's returns lie, metres; `None` of few of them.
    pub(crate) fn crown_depth_m(&self) -> Option<f64> {
        self.across.depth_m()
    }

    /// Share of the canopy that stands where the scanner drives; `None` where it is small.
    pub(crate) fn at_scanner(&self) -> Option<f64> {
        self.across.at_scanner(self.frame.distance_m)
    }

    /// Leaf area index of all that was met, by the row's sums so far, where it is more than any orchard has.
    pub(crate) fn too_many_leaves(&self, totals: &Totals) -> Option<f64> {
        let index = totals.contact_m2 / (totals.canopy_m * self.row_spacing_m?);
        Some(index).filter(|index| *index > MOST_LEAVES)
    }

    /// The ground's slope as it was found, where that is not the rig's.
    pub(crate) fn other_slope(&self) -> Option<OtherSlope> {
        self.ground.other_slope()
    }

    /// How high the ground lies above where the rig has it, if it reaches the rig's clearance or lies as far below, metres.
    pub(crate) fn other_level_m(&self) -> Option<f64> {
        self.ground.other_level_m()
    }
}
