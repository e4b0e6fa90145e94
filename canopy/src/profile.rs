//! The outline of the side that was scanned.

/// Highest height told apart, metres; higher returns count in the last cell.
const TOP_M: f64 = 20.0;
/// Height of a volume cell, metres.
pub(crate) const CELL_M: f64 = 0.1;

/// The crown's outline in one cell along the row: the outermost return per 10 cm of height.
///
/// Volume is filled from there to the row plane and doubled, as the other side is taken to be alike (row lidar volume).
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    nearest_m: Vec<f64>,
    length_m: f64,
}

impl Default for Outline {
    fn default() -> Self {
        Self { nearest_m: vec![f64::INFINITY; (TOP_M / CELL_M) as usize], length_m: 0.0 }
    }
}

impl Outline {
    pub(crate) fn add_line(&mut self, weight_m: f64) {
        self.length_m += weight_m;
    }

    pub(crate) fn add(&mut self, x_m: f64, z_m: f64) {
        let last = self.nearest_m.len() - 1;
        if let Some(nearest_m) = self.nearest_m.get_mut(((z_m / CELL_M).max(0.0) as usize).min(last)) {
            *nearest_m = nearest_m.min(x_m);
        }
    }

    /// What the cell holds, with the row plane at `distance_m`.
    pub(crate) fn section(&self, distance_m: f64) -> Section<'_> {
        Section { nearest_m: &self.nearest_m, length_m: self.length_m, distance_m }
    }

    /// Empties the outline.
    pub(crate) fn clear(&mut self) {
        self.nearest_m.fill(f64::INFINITY);
        self.length_m = 0.0;
    }
}

/// One cell along the row that ends: the outermost return per [`CELL_M`] of height.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Section<'a> {
    nearest_m: &'a [f64],
    pub(crate) length_m: f64,
    distance_m: f64,
}

impl Section<'_> {
    /// The volume, m³, both sides taken to be alike.
    pub(crate) fn volume_m3(&self) -> f64 {
        let half_area_m2: f64 =
            self.nearest_m.iter().map(|x_m| (self.distance_m - x_m).max(0.0) * CELL_M).sum();
        2.0 * half_area_m2 * self.length_m
    }

    /// Lower and upper edge of the cells that hold returns, metres above ground. None without returns.
    pub(crate) fn extent_m(&self) -> Option<[f64; 2]> {
        let hit = |x_m: &f64| x_m.is_finite();
        let lowest = self.nearest_m.iter().position(hit)?;
        let highest = self.nearest_m.iter().rposition(hit)?;
        Some([lowest as f64 * CELL_M, (highest + 1) as f64 * CELL_M])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_its_volume() {
        // Face 0.4 m before the row plane, 2 m high, 3 m long: 0.8 × 2 × 3 both sides together.
        let mut outline = Outline::default();
        for _ in 0..3 {
            outline.add_line(1.0);
            for band in 0..20 {
                outline.add(1.5, 0.05 + f64::from(band) * 0.1);
                outline.add(1.7, 0.05 + f64::from(band) * 0.1);
            }
        }
        outline.add(2.5, 3.0); // behind the row plane: no volume
        let section = outline.section(1.9);
        assert!((section.volume_m3() - 4.8).abs() < 1e-9);
        assert_eq!(section.extent_m(), Some([0.0, 3.1]));
        outline.clear();
        assert_eq!((outline.section(1.9).volume_m3(), outline.section(1.9).extent_m()), (0.0, None));
    }
}
