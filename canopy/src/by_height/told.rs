//! The profile as it is written.

use serde::Serialize;

/// The canopy by height. Bands count from the ground up, and all lists have the same bands: those up to the highest one in which the row has canopy.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct HeightProfile {
    /// Height of a band, metres.
    pub band_m: f64,
    /// Of the row.
    pub row: Vec<BandEstimate>,
    /// Of each tree, in the order of travel.
    pub trees: Vec<TreeBands>,
}

/// The bands of one tree.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TreeBands {
    /// Index of the tree, as in the estimate's `trees`.
    pub tree: u32,
    /// Its bands, from the ground up.
    pub bands: Vec<BandEstimate>,
}

/// One band of height. What is not known is `None`, never 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BandEstimate {
    /// Lower height above the ground, metres.
    pub from_m: f64,
    /// Upper height, metres.
    pub to_m: f64,
    /// One-sided leaf area, m²; the bands add up to the leaf area of the row or tree. `None` where that is withheld, and where no beam came.
    pub leaf_area_m2: Option<f64>,
    /// The ends within which it lies with 95 %, m². `None` where the row has no interval.
    pub leaf_area_interval_m2: Option<[f64; 2]>,
    /// The same by the row's own sampling and what bands are off alone, m².
    pub leaf_area_sampling_error_m2: Option<[f64; 2]>,
    /// Leaf area over [`volume_m3`](Self::volume_m3), m²/m³.
    pub density_m2_per_m3: Option<f64>,
    /// Canopy space that was scanned, m³: of each slice the voxels from the outermost one in which a beam ended, on either side of the row plane, to its mirror image.
    /// 0 where no beam ended.
    pub volume_m3: f64,
    /// Share of the passages of beams through the band's canopy space that go on; `None` without any.
    pub gap_fraction: Option<f64>,
    /// Share of the beams aimed at the band of the row plane that pass the crown; `None` below the crown's base (1 % of the returns are lower) and above its top (99.5 %).
    pub porosity: Option<f64>,
    /// Share of the canopy space that enough beams entered; the rest has what the fill rule gives it.
    pub visited: Option<f64>,
}
