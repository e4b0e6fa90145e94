//! The truth of a profile: exact leaf areas of a row by stretch and band of height.

use rowscan_canopy::Estimate;
use rowscan_scenes::{CellGrid, Orchard, RowCells, SeenRow};

use crate::cells_along::CellsAlong;

/// Most cells of a stretch, and most bands.
const MOST: f64 = 1e6;

/// The true leaf area of a row, by cell along the row and band of height.
#[derive(Debug)]
pub struct TruthByBand {
    /// From the ground up, m²: by cell along one period of the row, or along a row that ends.
    columns: Vec<Vec<f64>>,
    along: CellsAlong,
    start_m: f64,
    spacing_m: Option<f64>,
}

impl TruthByBand {
    /// Measures a row in bands of this height; the first line of an estimate of it lies at `start_m`.
    pub fn of((orchard, seen): (&Orchard, SeenRow), band_m: f64, start_m: f64) -> Self {
        let along = CellsAlong::of(orchard);
        let CellsAlong { count, cell_m, .. } = along;
        let mut columns = vec![Vec::new(); count];
        let cells =
            (count > 0).then(|| orchard.cells_of_row(seen.row, CellGrid { cell_m, band_m })).flatten();
        for cell in cells.iter().flat_map(RowCells::cells) {
            let band = (cell.z_from_m / band_m).round();
            let column = columns.get_mut((cell.y_from_m / cell_m).round().max(0.0) as usize);
            let Some(column) = column.filter(|_| band < MOST) else { continue };
            // What hangs below the ground's level is of the lowest band, as in an estimate.
            let band = band.max(0.0) as usize;
            if column.len() <= band {
                column.resize(band + 1, 0.0);
            }
            if let Some(sum) = column.get_mut(band) {
                *sum += cell.areas.leaf_area_m2;
            }
        }
        Self { columns, along, start_m, spacing_m: orchard.tree_spacing_m() }
    }

    /// Of as much of the row as an estimate scanned, so many bands from the ground up, m²; `None` where that is not known.
    pub fn of_row(&self, estimate: &Estimate, bands: usize) -> Option<Vec<f64>> {
        self.between([self.start_m, self.start_m + estimate.scanned_m?], bands)
    }

    /// Of a tree's stretch of the row.
    pub fn of_tree(&self, tree: u32, bands: usize) -> Option<Vec<f64>> {
        let spacing_m = self.spacing_m?;
        self.between([0.0, 1.0].map(|end| (f64::from(tree) + end) * spacing_m), bands)
    }

    /// A cell that only partly lies between counts by its share.
    fn between(&self, [from_m, to_m]: [f64; 2], bands: usize) -> Option<Vec<f64>> {
        let cells = (to_m - from_m) / self.along.cell_m;
        if cells.is_nan() || cells > MOST {
            return None;
        }
        let mut sums = vec![0.0; bands];
        for (cell, share) in self.along.between(from_m, to_m)? {
            let column = self.columns.get(cell);
            for (sum, leaf_m2) in sums.iter_mut().zip(column.into_iter().flatten()) {
                *sum += leaf_m2 * share;
            }
        }
        Some(sums)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_scenes::{Leaf, Tree};

    /// A row that ends has a truth within its ends, and none beyond.
    #[test]
    fn a_row_that_ends_is_known_up_to_its_ends() {
        let corners = [[-0.5, 0.5, 0.5], [-0.5, 1.5, 0.5], [-0.5, 1.5, 2.5], [-0.5, 0.5, 2.5]];
        let tree = Tree { leaves: vec![Leaf::new(corners).expect("a leaf")], ..Tree::default() };
        let mut scene = rowscan_scenes::files::load_scene("spindle", |_| {}).expect("built in");
        scene.drive.alleys = Some(2);
        let orchard = Orchard::from_trees(vec![tree], 2.0, Some(2.0), Some(4.0)).beside(&scene.drive);
        let truth = TruthByBand::of((&orchard, SeenRow::default()), 0.25, 0.0);
        let estimate = |scanned_m| Estimate { scanned_m: Some(scanned_m), ..Estimate::default() };
        let sum = |scanned_m| truth.of_row(&estimate(scanned_m), 12).map(|bands| bands.iter().sum::<f64>());
        assert!(sum(2.0).is_some_and(|sum| (sum - 2.0).abs() < 1e-6), "{:?}", sum(2.0));
        assert_eq!(sum(3.0), None);
    }

    #[test]
    fn a_board_has_its_area_in_every_band_and_stretch() {
        // A vertical leaf 1 m wide from y = 0.5 m, from 0.5 to 2.5 m high, in a row of 2 m that repeats.
        let corners = [[-0.5, 0.5, 0.5], [-0.5, 1.5, 0.5], [-0.5, 1.5, 2.5], [-0.5, 0.5, 2.5]];
        let leaf = Leaf::new(corners).expect("a leaf");
        let tree = Tree { leaves: vec![leaf], ..Tree::default() };
        let orchard = Orchard::from_trees(vec![tree], 2.0, Some(2.0), Some(4.0));
        let truth = TruthByBand::of((&orchard, SeenRow::default()), 0.25, 0.0);
        let estimate = |scanned_m| Estimate { scanned_m: Some(scanned_m), ..Estimate::default() };
        for (length_m, width_m) in [(2.0, 1.0), (1.0, 0.5), (4.0, 2.0), (3.03, 1.53)] {
            let found = truth.of_row(&estimate(length_m), 12).expect("a row that repeats");
            for (band, area_m2) in found.iter().enumerate() {
                let expected = if (2..10).contains(&band) { 0.25 * width_m } else { 0.0 };
                assert!((area_m2 - expected).abs() < 1e-6, "{length_m} m, band {band}: {area_m2}");
            }
        }
        let tree = truth.of_tree(0, 4).expect("a tree");
        assert!(
            tree.iter().zip([0.0, 0.0, 0.25, 0.25]).all(|(found, is)| (found - is).abs() < 1e-9),
            "{tree:?}"
        );
        assert_eq!(truth.of_row(&Estimate::default(), 4), None, "nobody knows how much was scanned");
    }
}
