//! Percentiles of lengths: below which height, within which half width a share of the canopy returns lies.
//!
//! Public, so that a truth can be measured by the very definition that estimators use.

/// Width of a bin, metres.
pub const BIN_M: f64 = 0.01;
/// Greatest length told apart, metres; greater ones count in the last bin.
const TOP_M: f64 = 20.0;
/// The share of the returns that stays below a tree's height, and within its half width.
pub const TOP_SHARE: f64 = 0.995;
/// The share of the returns that stays below a crown's base.
pub const BASE_SHARE: f64 = 0.01;

/// Lengths (heights, half widths) of canopy returns, in bins of a centimetre, weighted by line so that slow driving does not bias them.
#[derive(Clone, Debug)]
pub struct Histogram {
    bins: Vec<f64>,
    total: f64,
}

impl Histogram {
    /// Without returns.
    pub fn new() -> Self {
        Self { bins: vec![0.0; (TOP_M / BIN_M) as usize], total: 0.0 }
    }

    /// A return at `length_m`, on a line that stands for `weight_m` metres of row.
    pub fn add(&mut self, length_m: f64, weight_m: f64) {
        let last = self.bins.len() - 1;
        if let Some(bin) = self.bins.get_mut(((length_m / BIN_M).max(0.0) as usize).min(last)) {
            *bin += weight_m;
            self.total += weight_m;
        }
    }

    /// The length that a share of the returns stays below, metres. None without returns.
    pub fn percentile(&self, share: f64) -> Option<f64> {
        let mut above = self.total * (1.0 - share);
        // Counted from the top, so that rounding of the sum never walks past the last filled bin.
        let filled = self.bins.iter().enumerate().rev().filter(|(_, weight)| **weight > 0.0);
        let mut lowest_m = None;
        for (i, weight) in filled {
            if *weight > above {
                return Some((i as f64 + 1.0 - above / weight) * BIN_M);
            }
            above -= weight;
            lowest_m = Some(i as f64 * BIN_M);
        }
        lowest_m
    }

    /// Forgets all returns.
    pub fn clear(&mut self) {
        self.bins.fill(0.0);
        self.total = 0.0;
    }
}

impl Default for Histogram {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn height_is_the_upper_percentile_whatever_the_weights_add_up_to() {
        let mut heights = Histogram::new();
        for i in 0..10_000 {
            heights.add(f64::from(i) * 3.0 / 10_000.0, 0.013);
        }
        let height_m = heights.percentile(TOP_SHARE).unwrap();
        assert!((height_m - 0.995 * 3.0).abs() < 0.001, "{height_m}");
        assert!((heights.percentile(0.01).unwrap() - 0.03).abs() < 0.001);
        assert_eq!(heights.percentile(0.0), Some(0.0));
        heights.clear();
        assert_eq!(heights.percentile(TOP_SHARE), None);
    }

    #[test]
    fn one_stray_return_does_not_make_a_tree_taller() {
        let mut heights = Histogram::new();
        for _ in 0..1000 {
            heights.add(2.005, 0.02);
        }
        heights.add(9.0, 0.02);
        let height_m = heights.percentile(TOP_SHARE).unwrap();
        assert!((height_m - 2.01).abs() < 0.01, "{height_m}");
    }
}
