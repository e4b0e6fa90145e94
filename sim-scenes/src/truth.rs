//! What is there: exact leaf and wood areas, by tree, along the row and by height.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::Serialize;

use crate::bins::{Axis, Bins, MOST_BINS};
use crate::orchard::grown::Orchard;
use crate::organ::{Cylinder, Leaf, Surface, Tree};
use crate::support::SupportKind;
use crate::target::Adjustment;

/// The bins of slabs and bands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthGrid {
    /// Thickness of a slab along the row, metres; the last one ends with the row.
    pub slab_m: f64,
    /// Thickness of a height band, metres.
    pub band_m: f64,
}

impl Default for TruthGrid {
    fn default() -> Self {
        Self { slab_m: 0.1, band_m: 0.25 }
    }
}

/// The exact areas of one row. Leaf area is one-sided; wood area is the lateral surface of the branches.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// Seed of the orchard; null for a handmade one.
    pub seed: Option<u64>,
    /// The row, from 0, and how many there are.
    pub row: usize,
    /// Rows of the orchard.
    pub rows: usize,
    /// One-sided leaf area of the row, m².
    pub leaf_area_m2: f64,
    /// Lateral surface of the wood of the row, m².
    pub wood_area_m2: f64,
    /// Lateral surface of the posts of the row, m².
    pub post_area_m2: f64,
    /// Lateral surface of the wires of the row, m².
    pub wire_area_m2: f64,
    /// Surface of the fruit of the row, m².
    pub fruit_area_m2: f64,
    /// One-sided area of the grass and weeds of the row's strip and half alleys, m²; never part of the leaf area.
    pub grass_area_m2: f64,
    /// Inclination of the leaves from the horizontal, degrees: mean weighted by area; None without leaves.
    pub leaf_angle_mean_deg: Option<f64>,
    /// Its standard deviation, weighted by area too.
    pub leaf_angle_sd_deg: Option<f64>,
    /// How the target leaf area index was reached; left out without a target.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub adjustment: Option<Adjustment>,
    /// Leaf area over ground area (row spacing × places × tree spacing, gaps included); None where a spacing is unknown.
    pub lai: Option<f64>,
    /// By tree, in the order of the places.
    pub trees: Vec<TreeTruth>,
    /// By slab along the row, from y = 0 to the end of the period; leaves are cut at the faces. Empty for a scene without period.
    pub slabs: Vec<RowSlab>,
    /// By height band.
    pub bands: Vec<HeightBand>,
}

impl Orchard {
    /// What is there: the exact areas of the first row, by tree, slab and height band of the default grid.
    pub fn truth(&self) -> Truth {
        self.truth_of_row(0, TruthGrid::default())
    }

    /// The exact areas of one row (an empty row where there is no such row).
    pub fn truth_of_row(&self, row: usize, grid: TruthGrid) -> Truth {
        let trees: Vec<Cow<'_, Tree>> = self.trees_from_foot(row).collect();
        Truth::of_row(self, &trees, row, grid)
    }
}

/// One place of the row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TreeTruth {
    /// Place in the row, from 0.
    pub tree: u32,
    /// Middle of the tree's cell, metres; None where the spacing is unknown.
    pub y_m: Option<f64>,
    /// Number of leaves.
    pub leaves: usize,
    /// One-sided leaf area of the tree, wherever its crown reaches, m².
    pub leaf_area_m2: f64,
    /// One-sided leaf area within the tree's cell of the row, neighbours' leaves included and its own beyond left out, m²: what an
    /// estimator that cuts the row at the spacing looks for. None where the spacing is unknown or the row does not repeat.
    pub cell_leaf_area_m2: Option<f64>,
    /// Ground of the tree's cell, tree spacing × row spacing, m²; None where a spacing is unknown.
    #[serde(skip)]
    pub cell_ground_m2: Option<f64>,
    /// Lateral surface of its wood, m².
    pub wood_area_m2: f64,
    /// Leaf area over the ground it owns; None where a spacing is unknown.
    pub lai: Option<f64>,
    /// Highest point of leaf or wood above the row's foot, metres; 0 for a gap.
    pub height_m: f64,
}

/// What lies between two faces across the row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RowSlab {
    /// Lower face, metres.
    pub y_from_m: f64,
    /// Upper face, metres.
    pub y_to_m: f64,
    /// One-sided area of the leaf parts between the faces, m²: leaves are cut exactly.
    pub leaf_area_m2: f64,
    /// Lateral surface of the wood between the faces, m²: a branch is shared out along its axis.
    pub wood_area_m2: f64,
}

/// What lies between two heights above the row's foot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HeightBand {
    /// Lower height, metres.
    pub z_from_m: f64,
    /// Upper height, metres.
    pub z_to_m: f64,
    /// One-sided area of the leaf parts between the heights, m²: leaves are cut exactly.
    pub leaf_area_m2: f64,
    /// Lateral surface of the wood between the heights, m²: a branch is shared out along its axis.
    pub wood_area_m2: f64,
}

impl Truth {
    /// The tree at place `number` of the row, which repeats; of one whose trees have no cells, of its own places only.
    pub fn tree(&self, number: u32) -> Option<&TreeTruth> {
        let number = number as usize;
        let repeats = self.trees.iter().all(|tree| tree.cell_leaf_area_m2.is_some());
        self.trees.get(if repeats { number.checked_rem(self.trees.len())? } else { number })
    }

    /// Measures the trees of one row.
    pub(crate) fn of_row(orchard: &Orchard, trees: &[Cow<'_, Tree>], row: usize, grid: TruthGrid) -> Self {
        let cell_m2 = orchard.row_spacing_m().zip(orchard.tree_spacing_m()).map(|(row, tree)| row * tree);
        let mut by_tree: Vec<TreeTruth> = (0..)
            .zip(trees)
            .map(|(tree, organs)| TreeTruth::of(tree, organs, orchard.tree_spacing_m(), cell_m2))
            .collect();
        let cells = orchard
            .tree_spacing_m()
            .map_or_else(Vec::new, |spacing_m| slabs(trees, orchard.length_m(), spacing_m));
        for (tree, cell) in by_tree.iter_mut().zip(&cells) {
            tree.cell_leaf_area_m2 = Some(cell.leaf_area_m2);
        }
        let leaf_area_m2: f64 = by_tree.iter().map(|tree| tree.leaf_area_m2).sum();
        let surface = |surface| trees.iter().fold(0.0, |sum, tree| sum + tree.facet_area_m2(surface));
        let built = |kind| surface_of_supports(orchard, kind, row);
        let angle = leaf_angle(trees);
        Self {
            seed: orchard.seed(),
            row,
            rows: orchard.rows(),
            leaf_area_m2,
            post_area_m2: built(SupportKind::Post) + surface(Surface::Post),
            wire_area_m2: built(SupportKind::Wire) + surface(Surface::Wire),
            fruit_area_m2: surface(Surface::Fruit),
            grass_area_m2: surface(Surface::Grass)
                + orchard.ground().grass_area_m2(row, orchard.rows(), orchard.row_spacing_m()),
            leaf_angle_mean_deg: angle.map(|(mean, _)| mean),
            leaf_angle_sd_deg: angle.map(|(_, sd)| sd),
            adjustment: orchard.adjustment().copied(),
            wood_area_m2: by_tree.iter().map(|tree| tree.wood_area_m2).sum(),
            lai: cell_m2.filter(|_| !trees.is_empty()).map(|cell| leaf_area_m2 / (cell * trees.len() as f64)),
            trees: by_tree,
            slabs: slabs(trees, orchard.length_m(), grid.slab_m),
            bands: bands(trees, grid.band_m),
        }
    }
}

/// Lateral surface of a row's posts or wires.
fn surface_of_supports(orchard: &Orchard, kind: SupportKind, row: usize) -> f64 {
    let own = orchard.supports_of_row(row).filter(|(_, support)| support.kind == kind);
    own.fold(0.0, |sum, (_, support)| sum + support.shape.area_m2())
}

/// Mean and standard deviation of the leaves' inclinations, degrees, weighted by area.
fn leaf_angle(trees: &[Cow<'_, Tree>]) -> Option<(f64, f64)> {
    let inclined = |leaf: &Leaf| {
        let [.., z] = leaf.normal();
        (leaf.area_m2(), libm::acos(z.abs().min(1.0)).to_degrees())
    };
    let (mut area, mut first, mut second) = (0.0, 0.0, 0.0);
    for (weight, angle) in trees.iter().flat_map(|tree| tree.leaves.iter().map(inclined)) {
        area += weight;
        first += weight * angle;
        second += weight * angle * angle;
    }
    let mean = first / area;
    (area > 0.0).then(|| (mean, (second / area - mean * mean).max(0.0).sqrt()))
}

impl TreeTruth {
    /// Leaf area index of the tree's cell: the leaf area within it over its ground. None where either is unknown.
    pub fn cell_lai(&self) -> Option<f64> {
        Some(self.cell_leaf_area_m2? / self.cell_ground_m2?)
    }

    fn of(tree: u32, organs: &Tree, spacing_m: Option<f64>, cell_m2: Option<f64>) -> Self {
        let leaf_area_m2 = organs.leaf_area_m2();
        let leaf_tops = organs.leaves.iter().flat_map(|leaf| leaf.outline().iter().map(|[_, _, z]| *z));
        let wood_tops = organs.wood.iter().map(Cylinder::top_m);
        let facets = organs.facets.iter().flat_map(|facet| facet.polygon.outline());
        let leaf_tops = leaf_tops.chain(facets.map(|[_, _, z]| *z));
        Self {
            tree,
            y_m: spacing_m.map(|spacing| (f64::from(tree) + 0.5) * spacing),
            leaves: organs.leaves.len(),
            leaf_area_m2,
            cell_leaf_area_m2: None,
            cell_ground_m2: cell_m2,
            wood_area_m2: organs.wood_area_m2(),
            lai: cell_m2.map(|cell| leaf_area_m2 / cell),
            height_m: leaf_tops.chain(wood_tops).fold(0.0, f64::max),
        }
    }
}

/// Slabs from 0 to `length_m`, the last one ending there. Parts beyond count where the row repeats them.
fn slabs(trees: &[Cow<'_, Tree>], length_m: f64, slab_m: f64) -> Vec<RowSlab> {
    let Some(bins) = Bins::along_row(length_m, slab_m) else { return Vec::new() };
    let mut slabs: Vec<RowSlab> = (0..bins.count())
        .map(|k| {
            let [y_from_m, y_to_m] = bins.faces_m(k);
            RowSlab { y_from_m, y_to_m, leaf_area_m2: 0.0, wood_area_m2: 0.0 }
        })
        .collect();
    bins.fill(trees, |bin, leaf_m2, wood_m2| {
        if let Some(slab) = slabs.get_mut(bins.in_period(bin) as usize) {
            slab.leaf_area_m2 += leaf_m2;
            slab.wood_area_m2 += wood_m2;
        }
    });
    slabs
}

/// Bands of equal height about the row's foot, from the lowest organ's to the highest organ's.
fn bands(trees: &[Cow<'_, Tree>], band_m: f64) -> Vec<HeightBand> {
    let Some(bins) = Bins::even(Axis::Z, band_m) else { return Vec::new() };
    let mut areas = BTreeMap::new();
    bins.fill(trees, |bin, leaf_m2, wood_m2| {
        let (leaf, wood) = areas.entry(bin).or_insert((0.0, 0.0));
        *leaf += leaf_m2;
        *wood += wood_m2;
    });
    let Some((lowest, highest)) = areas.keys().next().zip(areas.keys().next_back()) else {
        return Vec::new();
    };
    let band = |k: i64| {
        let (leaf_area_m2, wood_area_m2) = areas.get(&k).copied().unwrap_or_default();
        let [z_from_m, z_to_m] = bins.faces_m(k);
        HeightBand { z_from_m, z_to_m, leaf_area_m2, wood_area_m2 }
    };
    (*lowest..=*highest).take(MOST_BINS as usize).map(band).collect()
}
