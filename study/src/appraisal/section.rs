//! A section of the row: what its organs add up to.

use rowscan_canopy::percentile::BIN_M;

use super::organs::Met;
use crate::cells_along::CELL_M;

/// Most cells of an outline, and bins of a distribution: lengths that no orchard has.
const MOST_CELLS: usize = 10_000;

/// What stands in 0.1 m of row.
#[derive(Clone, Debug, Default)]
pub(super) struct Section {
    pub(super) leaf_m2: f64,
    /// What leaves, wood and fruit turn to the beams.
    pub(super) facing_m2: f64,
    /// Returns by height, if no organ hid another.
    pub(super) heights: Shares,
    /// The same by distance before the row plane; what stands behind it is left out.
    pub(super) half_widths: Shares,
    /// How far the crown reaches before the row plane, by cell of height; 0 where it does not.
    half_width_m: Vec<f64>,
    /// Lowest and highest point.
    extent_m: Option<[f64; 2]>,
}

/// Returns by length, in the bins of the estimators' percentiles, as far as there are any.
#[derive(Clone, Debug, Default)]
pub(super) struct Shares(Vec<f64>);

impl Shares {
    fn add(&mut self, length_m: f64, returns: f64) {
        let bin = ((length_m / BIN_M).max(0.0) as usize).min(MOST_CELLS);
        if self.0.len() <= bin {
            self.0.resize(bin + 1, 0.0);
        }
        if let Some(sum) = self.0.get_mut(bin) {
            *sum += returns;
        }
    }

    /// Length (the middle of a bin, metres) and returns.
    pub(super) fn iter(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.0.iter().enumerate().map(|(bin, returns)| ((bin as f64 + 0.5) * BIN_M, *returns))
    }
}

impl Section {
    /// What beams meet in it.
    pub(super) fn meet(&mut self, met: &Met) {
        let [x_m, _, z_m] = met.at;
        self.facing_m2 += met.facing_m2;
        self.heights.add(z_m, met.returns());
        if x_m <= 0.0 {
            self.half_widths.add(-x_m, met.returns());
        }
    }

    /// A point that the outline reaches.
    pub(super) fn reach(&mut self, [x_m, _, z_m]: [f64; 3]) {
        let cell = ((z_m / CELL_M) as usize).min(MOST_CELLS);
        if self.half_width_m.len() <= cell {
            self.half_width_m.resize(cell + 1, 0.0);
        }
        if let Some(half_m) = self.half_width_m.get_mut(cell) {
            *half_m = half_m.max(-x_m);
        }
        let [low, high] = self.extent_m.unwrap_or([z_m, z_m]);
        self.extent_m = Some([low.min(z_m), high.max(z_m)]);
    }

    /// Area between outline and row plane, both sides taken to be alike, m².
    pub(super) fn crown_m2(&self) -> f64 {
        2.0 * self.half_width_m.iter().sum::<f64>() * CELL_M
    }

    /// From the lower edge of the lowest cell with an organ to the upper edge of the highest, metres.
    pub(super) fn wall_m(&self) -> f64 {
        let cell = |z_m: f64| (z_m / CELL_M).floor();
        self.extent_m.map_or(0.0, |[low, high]| (cell(high) + 1.0 - cell(low)) * CELL_M)
    }
}
