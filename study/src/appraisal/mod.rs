//! What an estimator's number should have been: measured on the leaves and branches themselves, by the same definition.
//!
//! The estimators never see this. A row is cut into sections of about 0.1 m; each keeps the exact leaf area between its faces, the
//! crown's outline on the scanner's side in cells of 0.1 m, and the heights and half widths of the returns that its organs would give if none hid
//! another. Any stretch of the row, which repeats, is summed from those. So a percentile is held against the same percentile and not against the
//! highest tip; what is left between the two is what beams do not reach.

mod organs;
mod section;

use rowscan_canopy::percentile::{BASE_SHARE, Histogram, TOP_SHARE};
use rowscan_canopy::{Measure, Quantity};
use rowscan_protocol::rig::Mount;
use rowscan_scenes::patches::Patch;
use rowscan_scenes::{Orchard, SeenRow, Surface, Truth, patches};

use organs::Eye;
use section::{Section, Shares};

use crate::cells_along::{CELL_M, CellsAlong};

/// Square metres in a hectare.
const HECTARE_M2: f64 = 10_000.0;

/// A row of an orchard, in sections.
#[derive(Clone, Debug)]
pub struct Appraisal {
    truth: Truth,
    sections: Vec<Section>,
    along: CellsAlong,
    row_spacing_m: Option<f64>,
    /// Of the whole row.
    finer: Vec<Measure>,
}

/// A row is scanned whole but for so much of it: a line more or less, or three.
const A_FEW_LINES: f64 = 0.005;

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
    /// Measures a row as a scanner on this mount, driven by a rig of this ground clearance, would look at it.
    pub fn of((orchard, seen): (&Orchard, SeenRow), mount: &Mount, clearance_m: f64) -> Self {
        let mut appraisal = Self::of_leaves(orchard, seen);
        appraisal.add_outline((orchard, seen), mount, clearance_m);
        appraisal
    }

    /// The same for someone who asks for these quantities and no others: where they are leaf areas, the crown's outline and returns, which take by far the
    /// most time, are left out.
    pub fn of_quantities(
        (orchard, seen): (&Orchard, SeenRow),
        mount: &Mount,
        clearance_m: f64,
        mut quantities: impl Iterator<Item = Quantity>,
    ) -> Self {
        if quantities.all(|quantity| matches!(quantity, Quantity::LeafArea | Quantity::Lai)) {
            return Self::of_leaves(orchard, seen);
        }
        Self::of((orchard, seen), mount, clearance_m)
    }

    /// The exact areas of the row, and the leaf areas of its sections.
    fn of_leaves(orchard: &Orchard, seen: SeenRow) -> Self {
        let along = CellsAlong::of(orchard);
        let grid = rowscan_scenes::TruthGrid { slab_m: along.cell_m, ..Default::default() };
        let truth = orchard.truth_of_row(seen.row, grid);
        let mut sections: Vec<Section> = vec![Section::default(); along.count];
        for (section, slab) in sections.iter_mut().zip(&truth.slabs) {
            section.leaf_m2 = slab.leaf_area_m2;
        }
        Self { truth, sections, along, row_spacing_m: orchard.row_spacing_m(), finer: Vec::new() }
    }

    /// The outline of the crown, and the returns that its organs would give.
    fn add_outline(&mut self, (orchard, seen): (&Orchard, SeenRow), mount: &Mount, clearance_m: f64) {
        let (length_m, section_m, sections) = (orchard.length_m(), self.along.cell_m, &mut self.sections);
        let count = sections.len();
        let at = |y_m: f64| ((y_m.rem_euclid(length_m) / section_m) as usize).min(count.saturating_sub(1));
        let mut put = |[x, y, z]: [f64; 3], add: &dyn Fn(&mut Section)| {
            // What is lower counts as ground.
            if let Some(section) = sections.get_mut(at(y)).filter(|_| z >= clearance_m && x.is_finite()) {
                add(section);
            }
        };
        let eye = Eye::of(mount);
        let spacing_m = orchard.row_spacing_m();
        let before = |point: [f64; 3]| seen.before(point, spacing_m);
        let turned = |patch: Patch| {
            let [across, along, up] = patch.normal;
            Patch { at: before(patch.at), normal: [seen.sense() * across, along, up], ..patch }
        };
        for tree in orchard.trees_from_foot(seen.row) {
            let of_canopy =
                tree.facets.iter().filter(|facet| matches!(facet.surface, Surface::Bark | Surface::Fruit));
            for blade in tree.leaves.iter().chain(of_canopy.map(|facet| &facet.polygon)) {
                patches::of_blade(blade, |patch| {
                    let patch = turned(patch);
                    if let Some(met) = eye.blade(&patch) {
                        put(patch.at, &|section| section.meet(&met));
                    }
                });
                for point in sampled(blade.outline()).into_iter().map(before) {
                    put(point, &|section| section.reach(point));
                }
            }
            for piece in &tree.wood {
                patches::of_branch(piece, |patch| {
                    let patch = turned(patch);
                    put(patch.at, &|section| section.reach(patch.at));
                    if let Some(met) = eye.branch(&patch) {
                        put(patch.at, &|section| section.meet(&met));
                    }
                });
            }
        }
    }

    /// Whether the organs by themselves tell what this quantity of a row really is.
    pub fn knows(quantity: Quantity) -> bool {
        match quantity {
            Quantity::LeafArea
            | Quantity::Lai
            | Quantity::TreeAreaIndex
            | Quantity::Height
            | Quantity::MedianHeight
            | Quantity::Base
            | Quantity::Width
            | Quantity::MedianWidth
            | Quantity::Volume
            | Quantity::TreeRowVolume
            | Quantity::LeafWallArea => true,
            // Only a finer scan, or the beams alone, define the others.
            _ => false,
        }
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

    /// The row between two places, repeated as often as they ask for; nothing is known of a stretch beyond a row that ends.
    pub fn stretch(&self, from_m: f64, to_m: f64) -> Stretch<'_> {
        let row_m = self.along.row_m();
        let length_m = (to_m - from_m).max(0.0);
        let whole = (length_m / row_m - 1.0).abs() < A_FEW_LINES;
        let mut parts = Vec::new();
        if row_m > 0.0 && length_m / row_m < 1000.0 {
            let cells = self.along.between(from_m, to_m).into_iter().flatten();
            parts.extend(cells.filter_map(|(cell, share)| Some((self.sections.get(cell)?, share))));
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

impl Stretch<'_> {
    fn sum(&self, of: impl Fn(&Section) -> f64) -> f64 {
        self.parts.iter().map(|(section, share)| of(section) * share).sum()
    }

    /// The length that a share of the returns stays below; None where nothing stands.
    fn percentile(&self, of: impl Fn(&Section) -> &Shares, share: f64) -> Option<f64> {
        let mut lengths = Histogram::new();
        for (section, part) in &self.parts {
            of(section).iter().for_each(|(length_m, returns)| lengths.add(length_m, returns * part));
        }
        lengths.percentile(share)
    }

    /// What a quantity really is; None where nothing but a finer scan could tell, or nothing stands there.
    pub fn value(&self, quantity: Quantity, band_m: Option<[f64; 2]>) -> Option<f64> {
        if self.parts.is_empty() {
            return None;
        }
        let ground_m2 = self.row.row_spacing_m.map(|spacing_m| spacing_m * self.length_m);
        let height_m = |share| self.percentile(|section| &section.heights, share);
        let width_m =
            |share| self.percentile(|section| &section.half_widths, share).map(|half_m| 2.0 * half_m);
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
            (Quantity::TreeAreaIndex, None) => Some(self.sum(|section| section.facing_m2) / ground_m2?),
            (Quantity::Height, None) => height_m(TOP_SHARE),
            (Quantity::MedianHeight, None) => height_m(0.5),
            (Quantity::Base, None) => height_m(BASE_SHARE),
            (Quantity::Width, None) => width_m(TOP_SHARE),
            (Quantity::MedianWidth, None) => width_m(0.5),
            (Quantity::Volume, None) => Some(self.sum(Section::crown_m2) * self.row.along.cell_m),
            (Quantity::TreeRowVolume, None) => {
                Some(height_m(TOP_SHARE)? * width_m(TOP_SHARE)? * HECTARE_M2 / self.row.row_spacing_m?)
            }
            (Quantity::LeafWallArea, None) => {
                let wall_m2 = self.sum(Section::wall_m) * self.row.along.cell_m;
                Some(2.0 * wall_m2 * HECTARE_M2 / (self.row.row_spacing_m? * self.length_m))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_scenes::{Cylinder, Leaf, Tree};

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

    /// The height on a wall `ahead_m` from the default mount's mirror below which a share of evenly spread beams ends.
    fn height_m(ahead_m: f64, [low_m, high_m]: [f64; 2], share: f64) -> f64 {
        let mirror_m = Mount::default().height_m;
        let angle = |z_m: f64| ((z_m - mirror_m) / ahead_m).atan();
        let at = angle(low_m) + share * (angle(high_m) - angle(low_m));
        mirror_m + ahead_m * at.tan()
    }

    #[test]
    fn a_board_has_its_areas_and_percentiles() {
        let appraisal = Appraisal::of((&board(), SeenRow::default()), &Mount::default(), 0.1);
        let row = appraisal.stretch(0.0, 2.0);
        let value = |quantity| row.value(quantity, None).expect("a number");
        close(row.value(Quantity::LeafArea, None), 2.0);
        close(row.value(Quantity::LeafArea, Some([0.5, 1.0])), 0.5);
        close(row.value(Quantity::Lai, None), 2.0 / 8.0);
        // Percentiles of beams, not the board's edges: 99.5 % of them end below 2.488 m. In bins of a centimetre.
        for (quantity, share) in
            [(Quantity::Height, 0.995), (Quantity::MedianHeight, 0.5), (Quantity::Base, 0.01)]
        {
            let expected = height_m(1.4, [0.5, 2.5], share);
            assert!((value(quantity) - expected).abs() < 0.01, "{quantity:?} {} {expected}", value(quantity));
        }
        assert!(value(Quantity::Height) < 2.495);
        // A bin of a centimetre on each side.
        for quantity in [Quantity::Width, Quantity::MedianWidth] {
            assert!((1.0..1.021).contains(&value(quantity)), "{}", value(quantity));
        }
        close(
            row.value(Quantity::TreeRowVolume, None),
            value(Quantity::Height) * value(Quantity::Width) * 1e4 / 4.0,
        );
        // 1.4 m off, its middle 0.1 m below: 1/2 ∫ 1.4 / hypot(1.4, z) dz over z = −1.1 to 0.9.
        let cosine = 0.7 * ((1.1f64 / 1.4).asinh() + (0.9f64 / 1.4).asinh());
        let index = value(Quantity::TreeAreaIndex);
        assert!((index / (2.0 * cosine / 8.0) - 1.0).abs() < 1e-3, "{index} {cosine}");
        assert_eq!(row.value(Quantity::Porosity, None), None);
        close(row.value(Quantity::Volume, None), 2.0);
        close(row.value(Quantity::LeafWallArea, None), 2.0 * 2.0 * 1e4 / 8.0);
    }

    #[test]
    fn a_wall_area_is_made_of_whole_cells() {
        // From 0.54 to 2.46 m: cells from 0.5 to 2.5 m hold returns, as the estimator's do.
        let corners = [[0.0, 0.0, 0.54], [0.0, 2.0, 0.54], [0.0, 2.0, 2.46], [0.0, 0.0, 2.46]];
        let tree = Tree { leaves: vec![Leaf::new(corners).expect("a leaf")], ..Tree::default() };
        let orchard = Orchard::from_trees(vec![tree], 2.0, Some(2.0), Some(4.0));
        let appraisal = Appraisal::of((&orchard, SeenRow::default()), &Mount::default(), 0.1);
        close(appraisal.stretch(0.0, 2.0).value(Quantity::LeafWallArea, None), 2.0 * 2.0 * 1e4 / 4.0);
    }

    #[test]
    fn a_post_of_wood_has_the_widths_of_a_circle() {
        let radius_m: f64 = 0.3;
        let wood = vec![Cylinder::new([0.0, 1.0, 0.5], [0.0, 1.0, 2.5], radius_m).expect("a post")];
        let tree = Tree { wood, ..Tree::default() };
        let orchard = Orchard::from_trees(vec![tree], 2.0, Some(2.0), Some(4.0));
        let appraisal = Appraisal::of((&orchard, SeenRow::default()), &Mount::default(), 0.1);
        let row = appraisal.stretch(0.0, 2.0);
        let value = |quantity| row.value(quantity, None).expect("a number");
        // Lines meet it evenly across: r √(1 − u²) with u even from −1 to 1; half of them within r √¾.
        let median_m = 2.0 * radius_m * 0.75f64.sqrt();
        assert!((value(Quantity::MedianWidth) - median_m).abs() < 0.02, "{}", value(Quantity::MedianWidth));
        assert!((value(Quantity::Width) - 2.0 * radius_m).abs() < 0.021, "{}", value(Quantity::Width));
        assert!((value(Quantity::MedianHeight) - height_m(1.66, [0.5, 2.5], 0.5)).abs() < 0.02);
        // In cells of 0.1 m as deep as the circle is at their end nearest to the axis, both sides; patches of 2 cm may miss that end.
        let depths = [0.0f64, 0.1, 0.2].map(|y_m| (radius_m * radius_m - y_m * y_m).sqrt());
        let volume_m3 = 2.0 * (2.0 * depths.iter().sum::<f64>() * 0.1) * 2.0;
        assert!((value(Quantity::Volume) / volume_m3 - 1.0).abs() < 0.03, "{}", value(Quantity::Volume));
        // Wood turns its width to the beams and counts in the tree area index; it has no leaf area.
        assert!(value(Quantity::TreeAreaIndex) > 0.5 * 2.0 * radius_m * 2.0 / 8.0);
        close(row.value(Quantity::LeafArea, None).map(|m2| m2 + 1.0), 1.0);
    }

    #[test]
    fn whoever_asks_for_leaf_areas_gets_the_same_without_an_outline() {
        let of = |quantities: &[Quantity]| {
            Appraisal::of_quantities(
                (&board(), SeenRow::default()),
                &Mount::default(),
                0.1,
                quantities.iter().copied(),
            )
        };
        let whole = Appraisal::of((&board(), SeenRow::default()), &Mount::default(), 0.1);
        let leaves = [Quantity::LeafArea, Quantity::Lai];
        let value = |of: &Appraisal, quantity| of.stretch(0.2, 2.2).value(quantity, None).map(f64::to_bits);
        assert!(leaves.iter().all(|quantity| value(&of(&leaves), *quantity) == value(&whole, *quantity)));
        // Whoever asks for anything else gets all of it.
        for quantity in Quantity::ALL.iter().filter(|quantity| !leaves.contains(quantity)) {
            let asked = of(&[Quantity::Lai, *quantity]);
            assert_eq!(value(&asked, *quantity), value(&whole, *quantity), "{quantity:?}");
        }
        assert!(value(&whole, Quantity::Volume).is_some());
    }

    /// A drive that turns on a headland goes on behind the row's end: there is no second row there.
    #[test]
    fn nothing_is_known_beyond_the_end_of_a_row_that_does_not_repeat() {
        let mut scene = rowscan_scenes::files::load_scene("spindle", |_| {}).expect("built in");
        scene.drive.alleys = Some(2);
        let ends = Appraisal::of((&board().beside(&scene.drive), SeenRow::default()), &Mount::default(), 0.1);
        let repeats = Appraisal::of((&board(), SeenRow::default()), &Mount::default(), 0.1);
        let leaf_m2 = |row: &Appraisal, to_m: f64| row.stretch(0.0, to_m).value(Quantity::LeafArea, None);
        close(leaf_m2(&ends, 2.02), 2.0);
        assert_eq!(leaf_m2(&ends, 6.0), None);
        close(leaf_m2(&repeats, 6.0), 6.0);
    }

    #[test]
    fn a_stretch_is_its_share_of_a_row_that_repeats() {
        let appraisal = Appraisal::of((&board(), SeenRow::default()), &Mount::default(), 0.1);
        let leaf = |from_m, to_m| appraisal.stretch(from_m, to_m).value(Quantity::LeafArea, None);
        close(leaf(0.0, 1.0), 1.0);
        close(leaf(0.55, 0.75), 0.4);
        close(leaf(1.0, 7.0), 6.0);
        close(leaf(-2.0, 0.0), 2.0);
        assert_eq!(appraisal.stretch(1.0, 1.0).value(Quantity::LeafArea, None), None);
    }
}
