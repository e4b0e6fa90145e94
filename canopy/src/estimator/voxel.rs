//! Leaf area density voxel by voxel: contact frequency, corrected for small samples, with an interval.
//!
//! Beams on exponential free paths with rate λ = G · LAD: K hits over Σ z, the sum of the free paths, is the most likely λ. It is
//! biased by + Σ_hits z / (Σ z)² to second order, which is taken off, and its variance is λ² / K (Pimont et al. 2018, who derive both
//! for lidar; the bias follows from E[K − λ Σ z] = 0 and Var[K − λ Σ z] = E[K]).
//!
//! Both hold for independent beams. Where a leaf is wider than the beams are apart, several end on it: hits are counted by patch
//! (hits whose neighbours on the line and on the line before stand at another range), and correction and variance are multiplied by
//! the slice's hits a patch. This factor is ours, not the paper's; `tests/estimators.rs` holds the interval's coverage. For beams with a width the interval
//! also holds what their correction may be off.

use super::contract::{Estimator, EstimatorInfo, Setting, Slice, Stretch, Z95};
use super::measure::{Measure, Quantity};
use crate::voxels::Voxel;

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "voxel",
    title: "leaf area density in voxels by hits over free path, misses used, corrected for small samples; G given",
    source: "Pimont et al. 2018, Remote Sens. Environ. 215:343; Béland et al. 2011, Agric. For. Meteorol. 151:1252",
    quantities: &[Quantity::LeafArea, Quantity::Lai, Quantity::LeafAreaDensity, Quantity::HitsPerPatch],
    make: |setting| Box::new(VoxelDensity::new(setting)),
};

/// Height of a reported band, metres.
const BAND_M: f64 = 0.5;

#[derive(Clone, Debug)]
struct VoxelDensity {
    projection: f64,
    /// Relative standard deviation of what the beams' width was taken out by; 0 for rays.
    spot_sd: f64,
    sums: Sums,
    /// Leaf area by band, m².
    bands_m2: Vec<f64>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    leaf_m2: f64,
    variance_m4: f64,
    /// Volume of the voxels with a hit, m³, and the leaf area seen in them.
    leafy_m3: f64,
    leafy_m2: f64,
    hits: f64,
    patches: f64,
}

impl VoxelDensity {
    fn new(setting: &Setting) -> Self {
        let bands = (setting.parameters.top_m / BAND_M).ceil().max(1.0) as usize;
        Self {
            projection: setting.parameters.projection,
            spot_sd: setting.parameters.spot_relative_sd(setting.frame.distance_m),
            sums: Sums::default(),
            bands_m2: vec![0.0; bands],
        }
    }

    /// Shares a layer's leaf area out over the bands it reaches into.
    fn spread(&mut self, [from_m, to_m]: [f64; 2], leaf_m2: f64) {
        for (band, sum_m2) in self.bands_m2.iter_mut().enumerate() {
            let (low_m, high_m) = (band as f64 * BAND_M, (band + 1) as f64 * BAND_M);
            let overlap_m = (to_m.min(high_m) - from_m.max(low_m)).max(0.0);
            *sum_m2 += leaf_m2 * overlap_m / (to_m - from_m);
        }
    }
}

impl Estimator for VoxelDensity {
    fn slice(&mut self, slice: &Slice<'_>) {
        let voxels = slice.voxels;
        let (min_beams, correlated) = (voxels.min_beams(), voxels.hits_per_patch());
        let rate = |voxel: &Voxel| {
            let bias = correlated * voxel.hit_path_m3 / (voxel.path_m2 * voxel.path_m2);
            Some((voxel.contact_frequency(min_beams)? - bias).max(0.0))
        };
        let m2_per_rate = voxels.volume_m3() / self.projection;
        let (mut seen_m2, mut leaf_m2) = (0.0, 0.0);
        for layer in voxels.layers(rate) {
            let of_layer_m2 = (layer.density + layer.filled) * m2_per_rate;
            leaf_m2 += of_layer_m2;
            seen_m2 += layer.density * m2_per_rate;
            self.spread(layer.z_m, of_layer_m2);
        }
        let mut leafy = 0.0;
        let mut variance = 0.0;
        for voxel in voxels.iter().filter(|voxel| voxel.hits_m > 0.0) {
            if let Some(rate) = rate(voxel) {
                leafy += 1.0;
                // λ² / K, with K the number of equally weighted hits.
                variance += rate * rate * voxel.hits_m2 / (voxel.hits_m * voxel.hits_m);
            }
        }
        // What stands in filled voxels is known no better than what it was copied from.
        let filled = if seen_m2 > 0.0 { leaf_m2 / seen_m2 } else { 1.0 };
        let sums = &mut self.sums;
        sums.leaf_m2 += leaf_m2;
        sums.variance_m4 += correlated * variance * (m2_per_rate * filled).powi(2);
        sums.leafy_m3 += leafy * voxels.volume_m3();
        sums.leafy_m2 += seen_m2;
        sums.hits += voxels.hits() as f64;
        sums.patches += voxels.hits() as f64 / correlated;
    }

    fn measures(&self, stretch: &Stretch, out: &mut Vec<Measure>) {
        let sums = &self.sums;
        let of = |quantity, value| Measure::new(INFO.name, quantity, value);
        // What the spot's correction may be off stands in every voxel alike.
        let of_spot_m2 = self.spot_sd * sums.leaf_m2;
        let half_m2 = Z95 * (sums.variance_m4 + of_spot_m2 * of_spot_m2).sqrt();
        let ends_m2 = [(sums.leaf_m2 - half_m2).max(0.0), sums.leaf_m2 + half_m2];
        let seen = stretch.scanned_m > 0.0;
        out.push(of(Quantity::LeafArea, seen.then_some(sums.leaf_m2)).within(ends_m2));
        if let Some(ground_m2) = stretch.ground_m2 {
            let lai = of(Quantity::Lai, Some(sums.leaf_m2 / ground_m2));
            out.push(lai.within(ends_m2.map(|end_m2| end_m2 / ground_m2)));
        }
        out.push(of(Quantity::LeafAreaDensity, Some(sums.leafy_m2 / sums.leafy_m3)));
        out.push(of(Quantity::HitsPerPatch, Some(sums.hits / sums.patches)));
        let top = self.bands_m2.iter().rposition(|leaf_m2| *leaf_m2 > 0.0).map_or(0, |band| band + 1);
        for (band, leaf_m2) in self.bands_m2.iter().take(top).enumerate() {
            let edges_m = [band as f64 * BAND_M, (band + 1) as f64 * BAND_M];
            out.push(of(Quantity::LeafArea, Some(*leaf_m2)).of_band(edges_m));
        }
    }

    fn clear(&mut self) {
        self.sums = Sums::default();
        self.bands_m2.fill(0.0);
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
