//! What is there: exact leaf and wood areas, by tree, along the row and by height.

use serde::Serialize;

use crate::orchard::Orchard;
use crate::organ::Tree;

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
    /// One-sided leaf area of the row, m².
    pub leaf_area_m2: f64,
    /// Lateral surface of the wood of the row, m².
    pub wood_area_m2: f64,
    /// Leaf area over ground area (row spacing × places × tree spacing, gaps included); None where a spacing is unknown.
    pub lai: Option<f64>,
    /// By tree, in the order of the places.
    pub trees: Vec<TreeTruth>,
    /// By slab along the row, from y = 0 to the end of the period; leaves are cut at the faces. Empty for a scene without period.
    pub slabs: Vec<RowSlab>,
    /// By height band.
    pub bands: Vec<HeightBand>,
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
    /// One-sided leaf area, m².
    pub leaf_area_m2: f64,
    /// Lateral surface of its wood, m².
    pub wood_area_m2: f64,
    /// Leaf area over the ground it owns; None where a spacing is unknown.
    pub lai: Option<f64>,
    /// Highest point of leaf or wood, metres; 0 for a gap.
    pub height_m: f64,
}

/// What lies between two faces across the row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RowSlab {
    /// Lower face, metres.
    pub y_from_m: f64,
    /// Upper face, metres.
    pub y_to_m: f64,
    /// One-sided area of the leaf parts between the faces, m².
    pub leaf_area_m2: f64,
}

/// What lies between two heights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HeightBand {
    /// Lower height, metres.
    pub z_from_m: f64,
    /// Upper height, metres.
    pub z_to_m: f64,
    /// One-sided area of the leaf parts between the heights, m².
    pub leaf_area_m2: f64,
}

impl Truth {
    pub(crate) fn of_row(orchard: &Orchard, _trees: &[Tree], _grid: TruthGrid) -> Self {
        Self {
            seed: orchard.seed(),
            leaf_area_m2: 0.0,
            wood_area_m2: 0.0,
            lai: None,
            trees: Vec::new(),
            slabs: Vec::new(),
            bands: Vec::new(),
        }
    }
}
