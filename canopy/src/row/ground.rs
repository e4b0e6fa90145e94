//! Whether the ground and the row lie where the rig has them, as far as the scans tell.

use super::Row;
use crate::ground_line::OtherSlope;
use crate::level::LevelSurface;

/// Ground that lies lower than the rig has it by more takes leaves with it, metres.
const FAR_BELOW_M: f64 = 0.35;
/// Returns of the canopy below which a ground that answers nothing says nothing.
const LEAST_RETURNS: u64 = 1000;

impl Row {
    /// The ground, where it lies among what counts as canopy: a level surface, and no ground where the rig puts it; or a part of what lies where the ground was
    /// found.
    pub(crate) fn ground_in_canopy(&self) -> Option<LevelSurface> {
        let mistaken = self.levels.mistaken_ground(self.totals.returns.ground, &self.table, &self.frame);
        mistaken.or_else(|| self.ground.in_canopy())
    }

    /// True where the ground lies so far below where the rig has it that leaves count as ground.
    pub(crate) fn takes_leaves_for_ground(&self) -> bool {
        self.other_level_m().is_some_and(|level_m| level_m < -FAR_BELOW_M)
    }

    /// Share of the beams that met something, of those that the rig leads to the ground before the row, where hardly one did.
    pub(crate) fn silent_ground(&self) -> Option<f64> {
        let tells = self.totals.returns.canopy >= LEAST_RETURNS;
        tells.then(|| self.answers.silent_ground(&self.table, &self.frame)).flatten()
    }

    /// Share of the row's room that no beam leads to, whatever stands there.
    pub(crate) fn out_of_sight(&self) -> f64 {
        self.voxels.out_of_sight()
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
