//! Whether what counts as canopy is a level surface: the ground, where a rig's height or roof puts it among the leaves.
//!
//! The ground is what lies below the rig's clearance over the slope that it tells. A height told a little too high, or a mirror told the wrong way up, leaves nothing there; then the real
//! ground is a level surface somewhere above it. Foliage has none: of a crown of 2 m no 20 cm hold a third of the returns.

use crate::geometry::{Beam, BeamTable, Frame};

/// Height of a bin, metres.
const BIN_M: f64 = 0.1;
/// Lowest height that is counted, metres.
const LOWEST_M: f64 = -2.0;
/// Bins, up to 10 m.
const BINS: usize = 120;
/// Share of the canopy's returns in two neighbouring bins that makes them level.
const LEVEL_SHARE: f64 = 0.3;
/// Share of all returns that the ground has at least where it is what the rig says.
const GROUND_SHARE: f64 = 0.01;
/// Share of the returns below the canopy's top.
const TOP_SHARE: f64 = 0.98;
/// Returns of the canopy below which nothing is said of where the ground lies.
pub(crate) const LEAST_CANOPY: u64 = 1000;

/// Ground that lies lower than the rig has it by more takes leaves with it, metres.
pub(crate) const FAR_BELOW_M: f64 = 0.35;
/// Share of the alley's returns so far below the ground that the rig tells from which on the rig has it wrong: nothing returns from below the ground, but what
/// was reflected twice, and furrows. A roll that is wrong by 40° to 100° puts a seventh and more there.
const BELOW_SHARE: f64 = 0.1;

/// What stands lower is grass, and no more than most clearances take, metres above the ground.
pub(crate) const GRASS_M: f64 = 0.3;
/// Share of the returns above grass that a clearance may take before that is told.
const CUT_SHARE: f64 = 0.02;

/// The canopy's returns by height.
#[derive(Clone, Debug)]
pub(crate) struct Levels {
    bins: [u64; BINS],
    returns: u64,
    /// Returns of the alley, before the row axis, and those far below its ground.
    alley: u64,
    far_below: u64,
    /// Returns above grass that the rig's clearance takes for ground.
    cut: u64,
}

impl Default for Levels {
    fn default() -> Self {
        Self { bins: [0; BINS], returns: 0, alley: 0, far_below: 0, cut: 0 }
    }
}

/// A level surface among the canopy's returns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LevelSurface {
    /// Its height above the ground that the rig tells, metres.
    pub(crate) z_m: f64,
    /// Share of the canopy's returns on it.
    pub(crate) share: f64,
}

impl Levels {
    /// Adds a return of the canopy, at this height above the ground that the rig tells.
    pub(crate) fn add(&mut self, z_m: f64) {
        self.returns += 1;
        let bin = (z_m - LOWEST_M) / BIN_M;
        if let Some(count) = (bin >= 0.0).then(|| self.bins.get_mut(bin as usize)).flatten() {
            *count += 1;
        }
    }

    /// Counts a return before the row axis, at this height above the ground that the rig tells. What lies behind may fall away: a ditch, a lower terrace.
    pub(crate) fn add_alley(&mut self, above_m: f64) {
        self.alley += 1;
        self.far_below += u64::from(above_m < -FAR_BELOW_M);
    }

    /// Counts a return that is ground by the rig's clearance, at this height above the ground that the rig tells.
    pub(crate) fn add_ground(&mut self, above_m: f64) {
        self.cut += u64::from(above_m > GRASS_M);
    }

    /// Share of the returns above grass that the rig's clearance takes for ground, where it is more than a few.
    pub(crate) fn cut(&self) -> Option<f64> {
        let all = self.returns + self.cut;
        let share = self.cut as f64 / all.max(1) as f64;
        (all >= LEAST_CANOPY && share > CUT_SHARE).then_some(share)
    }

    /// Share of the alley's returns far below the ground that the rig tells, where it is more than ground can have there.
    pub(crate) fn below_ground(&self, ground_returns: u64) -> Option<f64> {
        let share = self.far_below as f64 / self.alley.max(1) as f64;
        (self.returns + ground_returns >= LEAST_CANOPY && share > BELOW_SHARE).then_some(share)
    }

    /// Share of the returns that are ground, where it is next to nothing.
    pub(crate) fn no_ground(&self, ground_returns: u64) -> Option<f64> {
        let all = self.returns + ground_returns;
        let share = ground_returns as f64 / all.max(1) as f64;
        (all >= LEAST_CANOPY && share <= GROUND_SHARE).then_some(share)
    }

    /// The level surface that is the ground by all appearance: beams of this table lead to the ground that the rig tells, and none of them, but for stray
    /// ones, met it.
    pub(crate) fn mistaken_ground(
        &self,
        ground_returns: u64,
        table: &BeamTable,
        frame: &Frame,
    ) -> Option<LevelSurface> {
        if self.returns < LEAST_CANOPY || self.no_ground(ground_returns).is_none() {
            return None;
        }
        let leads_down = |beam: &Beam| {
            let (_, ends_m) = frame.above_clearance_m(beam);
            ends_m.is_finite() && ends_m * beam.cos < frame.distance_m
        };
        if !table.beams().iter().flatten().any(leads_down) {
            return None;
        }
        let (bin, most) = self.pairs().enumerate().max_by_key(|(_, count)| *count)?;
        let share = most as f64 / self.returns as f64;
        let z_m = LOWEST_M + (bin as f64 + 1.0) * BIN_M;
        (share >= LEVEL_SHARE).then_some(LevelSurface { z_m, share })
    }

    /// Up to where the canopy reaches, metres above the ground: 98 of 100 returns lie below. `None` of few returns.
    pub(crate) fn top_m(&self) -> Option<f64> {
        let mut below = 0;
        let bin = self.bins.iter().position(|count| {
            below += count;
            below as f64 >= TOP_SHARE * self.returns as f64
        })?;
        (self.returns >= LEAST_CANOPY).then_some(LOWEST_M + (bin as f64 + 1.0) * BIN_M)
    }

    /// Returns in neighbouring bins.
    fn pairs(&self) -> impl Iterator<Item = u64> {
        self.bins.iter().zip(self.bins.iter().skip(1)).map(|(low, high)| low + high)
    }
}
