//! What an estimator's number should have been: measured on the leaves and branches themselves, by the same definition.
//!
//! The estimators never see this. A row is cut into sections of about 0.1 m; each keeps the exact leaf area between its faces, and
//! the crown's outline on the scanner's side in cells of 0.1 m. Any stretch of the row, which repeats, is summed from those.

use rowscan_canopy::Quantity;
use rowscan_protocol::rig::Mount;
use rowscan_scenes::{Orchard, Truth};

/// Length of a section and height of an outline cell, metres.
const CELL_M: f64 = 0.1;
/// Organs lower than this are ground to the scanner as well, metres.
const HECTARE_M2: f64 = 10_000.0;
/// Most sections of a row.
const MOST_SECTIONS: f64 = 1e6;

/// The first row of an orchard, in sections.
#[derive(Clone, Debug)]
pub struct Appraisal {
    truth: Truth,
    sections: Vec<Section>,
    section_m: f64,
    row_spacing_m: Option<f64>,
}

#[derive(Clone, Debug, Default)]
struct Section {
    leaf_m2: f64,
    /// Σ leaf area · |beam · normal|: what the leaves turn towards the scanner.
    projected_m2: f64,
    /// How far the crown reaches before the row plane, by cell of height; 0 where it does not.
    half_width_m: Vec<f64>,
    /// Lowest and highest point.
    extent_m: Option<[f64; 2]>,
}

/// A stretch of the row: its organs between two places.
#[derive(Clone, Debug)]
pub struct Stretch<'a> {
    row: &'a Appraisal,
    /// Sections with their share in the stretch.
    parts: Vec<(&'a Section, f64)>,
    length_m: f64,
    /// True where the whole height's bands are the row's.
    whole: bool,
}

impl Appraisal {
    /// Measures the first row as a scanner on this mount, driven by a rig of this ground clearance, would look at it.
    pub fn of(orchard: &Orchard, mount: &Mount, clearance_m: f64) -> Self {
        let length_m = orchard.length_m();
        let count = (length_m / CELL_M).round();
        let count = if (1.0..=MOST_SECTIONS).contains(&count) { count as usize } else { 0 };
        let section_m = length_m / count as f64;
        let grid = rowscan_scenes::TruthGrid { slab_m: section_m, ..Default::default() };
        let truth = orchard.truth_of_row(0, grid);
        let mut sections: Vec<Section> = vec![Section::default(); count];
        for (section, slab) in sections.iter_mut().zip(&truth.slabs) {
            section.leaf_m2 = slab.leaf_area_m2;
        }
        let trees = orchard.trees().get(..orchard.trees_per_row()).unwrap_or_default();
        let at = |y_m: f64| ((y_m.rem_euclid(length_m) / section_m) as usize).min(count.saturating_sub(1));
        for leaf in trees.iter().flat_map(|tree| &tree.leaves) {
            let centroid = leaf.centroid();
            let [x, y, z] = centroid;
            let (ahead, up) = (x + mount.distance_m, z - mount.height_m);
            let [nx, _, nz] = leaf.normal();
            let cosine = ((ahead * nx + up * nz) / ahead.hypot(up)).abs();
            if let Some(section) = sections.get_mut(at(y)) {
                section.projected_m2 += leaf.area_m2() * cosine;
            }
            // Vertices, middles of edges, and the middle of the blade: closer than a cell is wide.
            let outline = leaf.outline();
            let next = outline.iter().cycle().skip(1);
            let middles = outline.iter().zip(next).map(|(a, b)| [0, 1, 2].map(|k| (a[k] + b[k]) / 2.0));
            for point in outline.iter().copied().chain(middles).chain([centroid]) {
                if let Some(section) = sections.get_mut(at(point[1])) {
                    section.reach(point, clearance_m);
                }
            }
        }
        for piece in trees.iter().flat_map(|tree| &tree.wood) {
            let (base, tip, radius_m) = (piece.base(), piece.tip(), piece.radius_m());
            let steps = (piece.length_m() / (CELL_M / 2.0)).ceil().clamp(1.0, 1000.0);
            for step in 0..=steps as usize {
                let share = step as f64 / steps;
                let [x, y, z] = [0, 1, 2].map(|k| base[k] + share * (tip[k] - base[k]));
                if let Some(section) = sections.get_mut(at(y)) {
                    section.reach([x - radius_m, y, z], clearance_m);
                }
            }
        }
        Self { truth, sections, section_m, row_spacing_m: orchard.row_spacing_m() }
    }

    /// The exact areas of the row.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The row between two places, repeated as often as they ask for.
    pub fn stretch(&self, from_m: f64, to_m: f64) -> Stretch<'_> {
        let row_m = self.section_m * self.sections.len() as f64;
        let length_m = (to_m - from_m).max(0.0);
        let whole = (length_m / row_m - 1.0).abs() < 1e-3;
        let mut parts = Vec::new();
        if row_m > 0.0 && length_m / row_m < 1000.0 {
            let first = (from_m / self.section_m).floor() as i64;
            let last = (to_m / self.section_m).ceil() as i64;
            for k in first..last {
                let (low_m, high_m) = (k as f64 * self.section_m, (k + 1) as f64 * self.section_m);
                let share = (high_m.min(to_m) - low_m.max(from_m)) / self.section_m;
                let section = self.sections.get(k.rem_euclid(self.sections.len() as i64) as usize);
                parts.extend(section.map(|section| (section, share)).filter(|(_, share)| *share > 1e-6));
            }
        }
        Stretch { row: self, parts, length_m, whole }
    }
}

impl Section {
    fn reach(&mut self, [x_m, _, z_m]: [f64; 3], clearance_m: f64) {
        if z_m < clearance_m {
            return;
        }
        let cell = (z_m / CELL_M) as usize;
        if self.half_width_m.len() <= cell {
            self.half_width_m.resize(cell.min(1000) + 1, 0.0);
        }
        if let Some(half_m) = self.half_width_m.get_mut(cell) {
            *half_m = half_m.max(-x_m);
        }
        let [low, high] = self.extent_m.unwrap_or([z_m, z_m]);
        self.extent_m = Some([low.min(z_m), high.max(z_m)]);
    }
}

impl Stretch<'_> {
    fn sum(&self, of: impl Fn(&Section) -> f64) -> f64 {
        self.parts.iter().map(|(section, share)| of(section) * share).sum()
    }

    fn most(&self, of: impl Fn(&Section) -> Option<f64>) -> Option<f64> {
        // A sliver of a section at an end is not in it.
        self.parts.iter().filter(|(_, share)| *share > 0.5).filter_map(|(s, _)| of(s)).reduce(f64::max)
    }

    /// What a quantity really is; None where nothing but a finer scan could tell, or nothing stands there.
    pub fn value(&self, quantity: Quantity, band_m: Option<[f64; 2]>) -> Option<f64> {
        if self.parts.is_empty() {
            return None;
        }
        let ground_m2 = self.row.row_spacing_m.map(|spacing_m| spacing_m * self.length_m);
        let top_m = || self.most(|section| section.extent_m.map(|[_, high]| high));
        let width_m = || {
            let widest = |section: &Section| section.half_width_m.iter().copied().reduce(f64::max);
            self.most(widest).map(|half_m| 2.0 * half_m)
        };
        match (quantity, band_m) {
            (Quantity::LeafArea, Some([from_m, to_m])) => self.whole.then(|| {
                let inside = |z_m: f64| z_m > from_m - 1e-9 && z_m < to_m + 1e-9;
                let bands = self.row.truth.bands.iter().filter(|b| inside(b.z_from_m) && inside(b.z_to_m));
                bands.map(|band| band.leaf_area_m2).sum()
            }),
            (_, Some(_)) => None,
            (Quantity::LeafArea, None) => Some(self.sum(|section| section.leaf_m2)),
            (Quantity::Lai, None) => Some(self.sum(|section| section.leaf_m2) / ground_m2?),
            (Quantity::TreeAreaIndex, None) => Some(self.sum(|section| section.projected_m2) / ground_m2?),
            (Quantity::Height, None) => top_m(),
            (Quantity::Width, None) => width_m(),
            (Quantity::Volume, None) => {
                let area_m2 = |section: &Section| 2.0 * section.half_width_m.iter().sum::<f64>() * CELL_M;
                Some(self.sum(area_m2) * self.row.section_m)
            }
            (Quantity::TreeRowVolume, None) => {
                Some(top_m()? * width_m()? * HECTARE_M2 / self.row.row_spacing_m?)
            }
            (Quantity::LeafWallArea, None) => {
                let height_m = |section: &Section| section.extent_m.map_or(0.0, |[low, high]| high - low);
                let wall_m2 = self.sum(height_m) * self.row.section_m;
                Some(2.0 * wall_m2 * HECTARE_M2 / (self.row.row_spacing_m? * self.length_m))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_scenes::{Leaf, Tree};

    /// A row of one tree in 2 m: a vertical leaf 1 m wide and 2 m high, 0.5 m before the row plane, from 0.5 m up.
    fn board() -> Orchard {
        let corners = [[-0.5, 0.5, 0.5], [-0.5, 1.5, 0.5], [-0.5, 1.5, 2.5], [-0.5, 0.5, 2.5]];
        let leaf = Leaf::new(corners).expect("a leaf");
        let tree = Tree { leaves: vec![leaf], wood: Vec::new() };
        Orchard::from_trees(vec![tree], 2.0, Some(2.0), Some(4.0))
    }

    fn close(found: Option<f64>, expected: f64) {
        assert!(found.is_some_and(|found| (found - expected).abs() < 1e-9), "{found:?} {expected}");
    }

    #[test]
    fn a_board_has_its_area_height_and_width() {
        let appraisal = Appraisal::of(&board(), &Mount::default(), 0.1);
        let row = appraisal.stretch(0.0, 2.0);
        close(row.value(Quantity::LeafArea, None), 2.0);
        close(row.value(Quantity::LeafArea, Some([0.5, 1.0])), 0.5);
        close(row.value(Quantity::Lai, None), 2.0 / 8.0);
        close(row.value(Quantity::Height, None), 2.5);
        close(row.value(Quantity::Width, None), 1.0);
        close(row.value(Quantity::TreeRowVolume, None), 2.5 * 1e4 / 4.0);
        // Seen from 1.4 m off and 0.1 m above its middle.
        let cosine = 1.4 / 1.4f64.hypot(0.1);
        close(row.value(Quantity::TreeAreaIndex, None), 2.0 * cosine / 8.0);
        assert_eq!(row.value(Quantity::Porosity, None), None);
    }

    #[test]
    fn a_stretch_is_its_share_of_a_row_that_repeats() {
        let appraisal = Appraisal::of(&board(), &Mount::default(), 0.1);
        let leaf = |from_m, to_m| appraisal.stretch(from_m, to_m).value(Quantity::LeafArea, None);
        close(leaf(0.0, 1.0), 1.0);
        close(leaf(0.55, 0.75), 0.4);
        close(leaf(1.0, 7.0), 6.0);
        close(leaf(-2.0, 0.0), 2.0);
        assert_eq!(appraisal.stretch(1.0, 1.0).value(Quantity::LeafArea, None), None);
    }
}
