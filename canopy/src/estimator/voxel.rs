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

use super::contract::{Estimator, EstimatorInfo, Setting, Slice, Stretch};
use super::measure::{Measure, Quantity};
use crate::regression::Z95;
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
    bands: Vec<Band>,
}

/// The leaf area of a height band.
#[derive(Clone, Copy, Debug, Default)]
struct Band {
    leaf_m2: f64,
    variance_m4: f64,
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
            bands: vec![Band::default(); bands],
        }
    }

    /// Shares a layer's leaf area out over the bands it reaches into; what it is off stands in all its parts alike.
    fn spread(&mut self, [from_m, to_m]: [f64; 2], layer: Band) {
        for (number, band) in self.bands.iter_mut().enumerate() {
            let (low_m, high_m) = (number as f64 * BAND_M, (number + 1) as f64 * BAND_M);
            let share = (to_m.min(high_m) - from_m.max(low_m)).max(0.0) / (to_m - from_m);
            band.leaf_m2 += layer.leaf_m2 * share;
            band.variance_m4 += layer.variance_m4 * share * share;
        }
    }

    /// The ends of the sampling error, 95 %; what the spot's correction may be off stands in every voxel alike.
    fn ends_m2(&self, leaf_m2: f64, variance_m4: f64) -> [f64; 2] {
        let of_spot_m2 = self.spot_sd * leaf_m2;
        let half_m2 = Z95 * (variance_m4 + of_spot_m2 * of_spot_m2).sqrt();
        [(leaf_m2 - half_m2).max(0.0), leaf_m2 + half_m2]
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
        // λ² / K, with K the number of equally weighted hits.
        let variance_of = |voxel: &Voxel| {
            let rate = rate(voxel).filter(|_| voxel.hits_m > 0.0)?;
            Some(rate * rate * voxel.hits_m2 / (voxel.hits_m * voxel.hits_m))
        };
        let (mut seen_m2, mut leaf_m2) = (0.0, 0.0);
        for (layer, scatter) in voxels.layers(rate).zip(voxels.layers(variance_of)) {
            let of_layer_m2 = (layer.density + layer.filled) * m2_per_rate;
            leaf_m2 += of_layer_m2;
            seen_m2 += layer.density * m2_per_rate;
            let filled = if layer.density > 0.0 { 1.0 + layer.filled / layer.density } else { 1.0 };
            let variance_m4 = correlated * scatter.density * (m2_per_rate * filled).powi(2);
            self.spread(layer.z_m, Band { leaf_m2: of_layer_m2, variance_m4 });
        }
        let mut leafy = 0.0;
        let mut variance = 0.0;
        for voxel in voxels.iter().filter(|voxel| voxel.hits_m > 0.0) {
            if let Some(of_voxel) = variance_of(voxel) {
                leafy += 1.0;
                variance += of_voxel;
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
        let ends_m2 = self.ends_m2(sums.leaf_m2, sums.variance_m4);
        let seen = stretch.scanned_m > 0.0;
        out.push(of(Quantity::LeafArea, seen.then_some(sums.leaf_m2)).within(ends_m2));
        if let Some(ground_m2) = stretch.ground_m2 {
            let lai = of(Quantity::Lai, Some(sums.leaf_m2 / ground_m2));
            out.push(lai.within(ends_m2.map(|end_m2| end_m2 / ground_m2)));
        }
        out.push(of(Quantity::LeafAreaDensity, Some(sums.leafy_m2 / sums.leafy_m3)));
        out.push(of(Quantity::HitsPerPatch, Some(sums.hits / sums.patches)));
        let top = self.bands.iter().rposition(|band| band.leaf_m2 > 0.0).map_or(0, |band| band + 1);
        for (number, band) in self.bands.iter().take(top).enumerate() {
            let edges_m = [number as f64 * BAND_M, (number + 1) as f64 * BAND_M];
            let ends_m2 = self.ends_m2(band.leaf_m2, band.variance_m4);
            out.push(of(Quantity::LeafArea, Some(band.leaf_m2)).within(ends_m2).of_band(edges_m));
        }
    }

    fn clear(&mut self) {
        self.sums = Sums::default();
        self.bands.fill(Band::default());
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
