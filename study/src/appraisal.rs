//! What an estimator's number should have been: measured on the leaves and branches themselves, by the same definition.
//!
//! The estimators never see this. A row is cut into sections of about 0.1 m; each keeps the exact leaf area between its faces, and
//! the crown's outline on the scanner's side in cells of 0.1 m. Any stretch of the row, which repeats, is summed from those.

use rowscan_canopy::{Measure, Quantity};
use rowscan_protocol::rig::Mount;
use rowscan_scenes::{Orchard, Truth};

/// Length of a section and height of an outline cell, metres.
const CELL_M: f64 = 0.1;
/// Square metres in a hectare.
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
    /// Of the whole row.
    finer: Vec<Measure>,
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
        let trees: Vec<_> = orchard.trees().take(orchard.trees_per_row()).collect();
        let at = |y_m: f64| ((y_m.rem_euclid(length_m) / section_m) as usize).min(count.saturating_sub(1));
        for leaf in trees.iter().flat_map(|tree| &tree.leaves) {
            let [nx, _, nz] = leaf.normal();
            let points = sampled(leaf.outline());
            let share_m2 = leaf.area_m2() / points.len().max(1) as f64;
            for point in points {
                let (ahead, up) = (point[0] + mount.distance_m, point[2] - mount.height_m);
                let cosine = ((ahead * nx + up * nz) / ahead.hypot(up)).abs();
                if let Some(section) = sections.get_mut(at(point[1])) {
                    section.projected_m2 += share_m2 * cosine;
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
        Self { truth, sections, section_m, row_spacing_m: orchard.row_spacing_m(), finer: Vec::new() }
    }

    /// The same, and what `reference` measured on a finer scan stands for what only that can tell: gaps, porosity, impacted area.
    #[must_use]
    pub fn with_finer_scan(self, reference: Vec<Measure>) -> Self {
        Self { finer: reference, ..self }
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

/// Points of a blade, closer to each other than a cell is wide: each triangle about the first vertex, cut evenly.
fn sampled(outline: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    let Some((first, rest)) = outline.split_first() else { return points };
    for pair in rest.windows(2) {
        let [a, b] = pair else { continue };
        let way = |p: &[f64; 3], q: &[f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
        let longest_m = way(first, a).max(way(a, b)).max(way(b, first));
        let steps = (longest_m / (CELL_M / 2.0)).ceil().clamp(1.0, 200.0) as usize;
        for i in 0..=steps {
            for k in 0..=steps - i {
                let (u, v) = (i as f64 / steps as f64, k as f64 / steps as f64);
                let point = [0, 1, 2].map(|c| first[c] + u * (a[c] - first[c]) + v * (b[c] - first[c]));
                // A hair's breadth within: a blade that ends at a cell's face does not reach into the next cell.
                let middle = [0, 1, 2].map(|c| (first[c] + a[c] + b[c]) / 3.0);
                points.push([0, 1, 2].map(|c| point[c] + 1e-6 * (middle[c] - point[c])));
            }
        }
    }
    points
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
            (Quantity::GapFraction | Quantity::Porosity | Quantity::ImpactedArea, _) => {
                let same = |m: &&Measure| m.quantity == quantity && m.band_m() == band_m;
                self.row.finer.iter().filter(|_| self.whole).find(same)?.value
            }
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
        let tree = Tree { leaves: vec![leaf], ..Tree::default() };
        Orchard::from_trees(vec![tree], 2.0, Some(2.0), Some(4.0))
    }

    fn close(found: Option<f64>, expected: f64) {
        assert!(found.is_some_and(|found| (found / expected - 1.0).abs() < 1e-5), "{found:?} {expected}");
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
        // 1.4 m off, its middle 0.1 m below: 1/2 ∫ 1.4 / hypot(1.4, z) dz over z = −1.1 to 0.9.
        let cosine = 0.7 * ((1.1f64 / 1.4).asinh() + (0.9f64 / 1.4).asinh());
        let index = row.value(Quantity::TreeAreaIndex, None).expect("a number");
        assert!((index / (2.0 * cosine / 8.0) - 1.0).abs() < 0.02, "{index} {cosine}");
        assert_eq!(row.value(Quantity::Porosity, None), None);
        close(row.value(Quantity::Volume, None), 2.0);
        close(row.value(Quantity::LeafWallArea, None), 2.0 * 2.0 * 1e4 / 8.0);
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
