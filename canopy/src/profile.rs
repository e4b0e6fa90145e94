//! Height and volume of the side that was scanned.

/// Height bins, metres.
const BIN_M: f64 = 0.01;
/// Highest height told apart, metres; higher returns count in the last bin.
const TOP_M: f64 = 20.0;
/// Height of a volume cell, metres.
const CELL_M: f64 = 0.1;
/// The share of the returns that stays below a tree's height.
const HEIGHT_SHARE: f64 = 0.995;

/// Heights of one tree's canopy returns, in bins of a centimetre, weighted by line so that slow driving does not bias them.
#[derive(Clone, Debug)]
pub(crate) struct HeightHistogram {
    bins: Vec<f64>,
    total: f64,
}

impl HeightHistogram {
    pub(crate) fn new() -> Self {
        Self { bins: vec![0.0; (TOP_M / BIN_M) as usize], total: 0.0 }
    }

    pub(crate) fn add(&mut self, z_m: f64, weight_m: f64) {
        let last = self.bins.len() - 1;
        if let Some(bin) = self.bins.get_mut(((z_m / BIN_M).max(0.0) as usize).min(last)) {
            *bin += weight_m;
            self.total += weight_m;
        }
    }

    /// The height that 99.5 % of the returns stay below, metres; empties the histogram. None without returns.
    pub(crate) fn close(&mut self) -> Option<f64> {
        let mut above = self.total * (1.0 - HEIGHT_SHARE);
        // Counted from the top, so that rounding of the sum never walks past the last filled bin.
        let height_m = self.bins.iter().enumerate().rev().filter(|(_, weight)| **weight > 0.0).find_map(
            |(i, weight)| {
                if *weight > above {
                    Some((i as f64 + 1.0 - above / weight) * BIN_M)
                } else {
                    above -= weight;
                    None
                }
            },
        );
        self.bins.fill(0.0);
        self.total = 0.0;
        height_m
    }
}

/// The crown's outline in one cell along the row: the outermost return per 10 cm of height.
///
/// Volume is filled from there to the row plane and doubled, as the other side is taken to be alike (row lidar volume).
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    nearest_m: Vec<f64>,
    length_m: f64,
}

impl Outline {
    pub(crate) fn new() -> Self {
        Self { nearest_m: vec![f64::INFINITY; (TOP_M / CELL_M) as usize], length_m: 0.0 }
    }

    pub(crate) fn add_line(&mut self, weight_m: f64) {
        self.length_m += weight_m;
    }

    pub(crate) fn add(&mut self, x_m: f64, z_m: f64) {
        let last = self.nearest_m.len() - 1;
        if let Some(nearest_m) = self.nearest_m.get_mut(((z_m / CELL_M).max(0.0) as usize).min(last)) {
            *nearest_m = nearest_m.min(x_m);
        }
    }

    /// The volume, m³, with the row plane at `distance_m`; empties the outline.
    pub(crate) fn close(&mut self, distance_m: f64) -> f64 {
        let half_area_m2: f64 = self.nearest_m.iter().map(|x_m| (distance_m - x_m).max(0.0) * CELL_M).sum();
        let volume_m3 = 2.0 * half_area_m2 * self.length_m;
        self.nearest_m.fill(f64::INFINITY);
        self.length_m = 0.0;
        volume_m3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn height_is_the_upper_percentile_whatever_the_weights_add_up_to() {
        let mut heights = HeightHistogram::new();
        for i in 0..10_000 {
            heights.add(f64::from(i) * 3.0 / 10_000.0, 0.013);
        }
        let height_m = heights.close().unwrap();
        assert!((height_m - 0.995 * 3.0).abs() < 0.001, "{height_m}");
        assert_eq!(heights.close(), None);
    }

    #[test]
    fn one_stray_return_does_not_make_a_tree_taller() {
        let mut heights = HeightHistogram::new();
        for _ in 0..1000 {
            heights.add(2.005, 0.02);
        }
        heights.add(9.0, 0.02);
        let height_m = heights.close().unwrap();
        assert!((height_m - 2.01).abs() < 0.01, "{height_m}");
    }

    #[test]
    fn a_box_has_its_volume() {
        // Face 0.4 m before the row plane, 2 m high, 3 m long: 0.8 × 2 × 3 both sides together.
        let mut outline = Outline::new();
        for _ in 0..3 {
            outline.add_line(1.0);
            for band in 0..20 {
                outline.add(1.5, 0.05 + f64::from(band) * 0.1);
                outline.add(1.7, 0.05 + f64::from(band) * 0.1);
            }
        }
        outline.add(2.5, 3.0); // behind the row plane: no volume
        assert!((outline.close(1.9) - 4.8).abs() < 1e-9);
        assert_eq!(outline.close(1.9), 0.0);
    }
}
