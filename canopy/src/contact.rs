//! Leaf area by contact frequency: per voxel, leaf area density = hits / Σ free path / G, times the voxel's volume.
//!
//! Misses are what makes the estimate unbiased: their free path counts right through the region ([`Voxels`]).
//!
//! Small samples: hits / Σ free path is a ratio, biased upwards where a voxel holds few independent looks.
//! - Few beams: N independent beams of optical depth x bias it by (p − x(1 − p)) / (N p²), p = 1 − exp(−x), which is
//!   1/(2N) for thin voxels; so it is multiplied by 1 − 1/(2N). Below `min_beams` a voxel counts as unvisited. With
//!   infinitely small leaves the sum is then within 1 % up to an optical depth of 4.
//! - Few lines: beams of one line that one leaf stops are one look. At 12 lines a voxel it is +0 to −2 %, at 4 +4 %, at 2 +11 %, at 1.25 +20 % on
//!   rows of `spindle`: +28 % over the number of lines. Not corrected: the rule for the voxels' edge keeps lines enough where the rig's speed is right,
//!   and the spacing of lines is a key of a calibration's class ([`ClassKey::LineSpacing`](crate::ClassKey::LineSpacing)).
//! - Few leaves, each blocking many beams: not corrected, as the leaf size is unknown. On slabs of 6 cm leaves at
//!   1.5 m²/m³ the bias was +7 % with voxels of 0.125 m, +2 % with 0.25 m (8 leaves a voxel) and under 1 % with 0.5 m,
//!   which follow a crown's outline less well. A calibration holds it; the `voxel` estimator corrects it.

use crate::across::{GROWTH_BANDS, growth_band};
use crate::estimate::ContactReport;
use crate::parameters::Parameters;
use crate::uncertainty::Unresolved;
use crate::voxels::{Voxel, Voxels, scatter_m};

/// No foliage is denser, m² a m³: the densest hedges have 10 to 20. What is, is a wall or a sheet.
const DENSEST: f64 = 100.0;

/// Hits from which a voxel tells whether it holds a sheet.
const HITS_OF_SHEET: f64 = 20.0;
/// Of so many hits on a sheet, beams behind it at most: what its edge lets by.
const BEHIND_SHEET: f64 = 1.0 / 50.0;
/// Hits from which a row tells whether all of them lie in one plane.
const HITS_OF_PLANE: u64 = 500;
/// Hits on a sheet scatter no more across the row, metres: by as much as a scanner's noise. Beams that enter foliage of the greatest density reach as deep.
const SHEET_SD_M: f64 = 0.025;

/// What slices tell, summed over them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sampled {
    /// Raw leaf area, m².
    pub(crate) leaf_m2: f64,
    /// Of that, what the fill rule gives unvisited voxels.
    filled_m2: f64,
    /// The same in layers that begin in a band in which growth is looked for ([`growth_band`]).
    growth_m2: [f64; GROWTH_BANDS],
    visited: u64,
    unvisited: u64,
    /// Voxels that were hit.
    hit: u64,
    /// Beams that ended in a voxel.
    pub(crate) hits: u64,
    /// Σ line weight over hits, and over those in voxels denser than foliage; metres.
    hits_m: f64,
    too_dense_m: f64,
    /// The same over hits in voxels that enough beams passed to tell a density.
    told_m: f64,
    /// Σ contact frequency and Σ of its square over voxels that enough beams passed, 1/m and 1/m².
    frequencies: (f64, f64),
    /// Σ line weight · distance across the row over hits, m², and the same of its square, m³.
    hits_x_m2: f64,
    hits_x2_m3: f64,
}

impl Sampled {
    /// Of the open slice as it stands.
    pub(crate) fn of(voxels: &Voxels, projection: f64) -> Self {
        let density = |voxel: &Voxel| density(voxel, voxels.min_beams());
        let per_density_m2 = voxels.volume_m3() / projection;
        let mut sampled = Self { hits: voxels.hits(), ..Self::default() };
        for layer in voxels.layers(density) {
            let leaf_m2 = (layer.density + layer.filled) * per_density_m2;
            sampled.leaf_m2 += leaf_m2;
            sampled.filled_m2 += layer.filled * per_density_m2;
            if let Some(growth_m2) =
                growth_band(layer.z_m[0]).and_then(|band| sampled.growth_m2.get_mut(band))
            {
                *growth_m2 += leaf_m2;
            }
            sampled.visited += u64::from(layer.visited);
            sampled.unvisited += u64::from(layer.unvisited);
        }
        let too_dense = DENSEST * projection;
        for (layer, _) in voxels.bare_layers() {
            let behind = layer.iter().skip(1).map(Some).chain([None]);
            for (voxel, behind) in layer.iter().zip(behind) {
                sampled.hits_m += voxel.hits_m;
                sampled.hit += u64::from(voxel.hits_m > 0.0);
                let found = density(voxel);
                sampled.told_m += if found.is_some() { voxel.hits_m } else { 0.0 };
                sampled.hits_x_m2 += voxel.hits_x_m2;
                sampled.hits_x2_m3 += voxel.hits_x2_m3;
                let frequency = found.unwrap_or(0.0);
                sampled.frequencies.0 += frequency;
                sampled.frequencies.1 += frequency * frequency;
                let is_dense = found.is_some_and(|found| found > too_dense);
                if is_dense || behind.is_some_and(|behind| is_sheet(voxel, behind)) {
                    sampled.too_dense_m += voxel.hits_m;
                }
            }
        }
        sampled
    }

    pub(crate) fn add(&mut self, slice: &Self) {
        self.leaf_m2 += slice.leaf_m2;
        self.filled_m2 += slice.filled_m2;
        for (sum_m2, slice_m2) in self.growth_m2.iter_mut().zip(slice.growth_m2) {
            *sum_m2 += slice_m2;
        }
        self.visited += slice.visited;
        self.unvisited += slice.unvisited;
        self.hit += slice.hit;
        self.hits += slice.hits;
        self.hits_m += slice.hits_m;
        self.too_dense_m += slice.too_dense_m;
        self.told_m += slice.told_m;
        self.frequencies.0 += slice.frequencies.0;
        self.frequencies.1 += slice.frequencies.1;
        self.hits_x_m2 += slice.hits_x_m2;
        self.hits_x2_m3 += slice.hits_x2_m3;
    }

    /// Share of the hits whose voxel is denser than any foliage; all of them where they lie in one plane, as on a net.
    pub(crate) fn too_dense(&self) -> f64 {
        let sd_m = scatter_m(self.hits_m, self.hits_x_m2, self.hits_x2_m3);
        match sd_m {
            Some(sd_m) if self.hits >= HITS_OF_PLANE && sd_m <= SHEET_SD_M => 1.0,
            Some(_) => self.too_dense_m / self.hits_m,
            None => 0.0,
        }
    }

    /// Share of the hits whose voxel too few beams passed to tell a density; 0 without a hit.
    pub(crate) fn untold(&self) -> f64 {
        if self.hits_m > 0.0 { 1.0 - self.told_m / self.hits_m } else { 0.0 }
    }

    /// Share of the leaf area in the lowest bands, so many of which growth reaches.
    pub(crate) fn within_growth(&self, bands: usize) -> f64 {
        let low_m2: f64 = self.growth_m2.iter().take(bands).sum();
        if self.leaf_m2 > 0.0 { (low_m2 / self.leaf_m2).min(1.0) } else { 0.0 }
    }

    /// How much of the leaf area the beams did not resolve, with voxels of this edge.
    pub(crate) fn unresolved(&self, edge_m: f64) -> Unresolved {
        let (sum, squares) = self.frequencies;
        Unresolved {
            filled: if self.leaf_m2 > 0.0 { self.filled_m2 / self.leaf_m2 } else { 0.0 },
            // The mean by leaf area.
            optical_depth: if sum > 0.0 { squares / sum * edge_m } else { 0.0 },
        }
    }

    /// Share of the row's voxels that too few beams reached.
    pub(crate) fn unseen(&self) -> f64 {
        self.unvisited as f64 / (self.unvisited + self.visited).max(1) as f64
    }

    /// How many voxels nobody could look into, of these and of those that were hit: how much of the canopy hangs on what stands in for them.
    pub(crate) fn hidden(&self) -> f64 {
        self.unvisited as f64 / (self.unvisited + self.hit).max(1) as f64
    }

    /// For an estimate: of slices this long, with lines so far apart.
    pub(crate) fn report(
        &self,
        slice_m: f64,
        line_spacing_m: Option<f64>,
        parameters: &Parameters,
    ) -> ContactReport {
        ContactReport {
            projection: parameters.projection,
            voxel_m: parameters.voxel_m,
            voxel_by: parameters.voxel_by,
            slice_m,
            line_spacing_m,
            hits: self.hits,
            too_dense: self.too_dense(),
            voxels_visited: self.visited,
            voxels_unvisited: self.unvisited,
            leaf_area_filled_m2: Some(self.filled_m2),
            clumping: None,
        }
    }
}

/// True of a voxel whose hits lie in one plane that lets nothing through to the voxel `behind`. In foliage so dense that no beam passes, they scatter.
fn is_sheet(voxel: &Voxel, behind: &Voxel) -> bool {
    let hits = voxel.hits_counted();
    hits >= HITS_OF_SHEET
        && f64::from(behind.beams) <= hits * BEHIND_SHEET
        && voxel.hits_sd_m().is_some_and(|sd_m| sd_m <= SHEET_SD_M)
}

/// Leaf area density times G, 1/m; None where too few beams entered.
pub(crate) fn density(voxel: &Voxel, min_beams: u32) -> Option<f64> {
    let unbiased = 1.0 - 0.5 / f64::from(voxel.beams.max(1));
    Some(voxel.contact_frequency(min_beams)? * unbiased)
}
