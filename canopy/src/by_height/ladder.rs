//! Bands of height over the layers of the voxels.

use crate::error::PipelineError;
use crate::geometry::Frame;
use crate::voxels::Region;

/// The least and the greatest height of a band, metres.
pub const BAND_HEIGHTS_M: [f64; 2] = [0.1, 0.5];

/// Where the bands are, and the voxels that they are made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ladder {
    /// Height of a band, metres; the first one begins at the ground.
    pub(super) band_m: f64,
    /// Bands.
    pub(super) count: usize,
    pub(super) region: Region,
    /// Of the mirror, metres.
    pub(super) height_m: f64,
    /// From the mirror to the row plane, metres.
    pub(super) distance_m: f64,
}

impl Ladder {
    /// # Errors
    /// A band that is too low or too high.
    pub(super) fn new(band_m: f64, region: Region, frame: &Frame) -> Result<Self, PipelineError> {
        let [low_m, high_m] = BAND_HEIGHTS_M;
        PipelineError::check("profile", band_m, low_m, high_m)?;
        let top_m = region.z_m + region.nz as f64 * region.dz_m;
        let count = (top_m / band_m - 1e-9).ceil().max(1.0) as usize;
        let Frame { height_m, distance_m, .. } = *frame;
        Ok(Self { band_m, count, region, height_m, distance_m })
    }

    /// Lower and upper height of a band, metres.
    pub(super) fn edges_m(&self, band: usize) -> [f64; 2] {
        [band, band + 1].map(|edge| edge as f64 * self.band_m)
    }

    /// The band that a height lies in; `None` below the ground and above the highest one.
    pub(super) fn band(&self, z_m: f64) -> Option<usize> {
        let band = (z_m / self.band_m).floor();
        (band >= 0.0 && band < self.count as f64).then_some(band as usize)
    }

    /// The layer of voxels that a height lies in.
    pub(super) fn layer(&self, z_m: f64) -> usize {
        let Region { z_m: low_m, dz_m, nz, .. } = self.region;
        (((z_m - low_m) / dz_m).max(0.0) as usize).min(nz.saturating_sub(1))
    }

    /// The column of voxels that a way across the row lies in.
    pub(super) fn column(&self, x_m: f64) -> usize {
        let Region { x_m: near_m, dx_m, nx, .. } = self.region;
        (((x_m - near_m) / dx_m).max(0.0) as usize).min(nx.saturating_sub(1))
    }

    /// Columns from the row plane to this one, both sides alike: 1 for the two that touch it.
    pub(super) fn columns_out(&self, column: usize) -> usize {
        let row = self.region.row;
        if column < row { row - column } else { column + 1 - row }
    }

    /// The columns so far out on both sides, as far as there are voxels.
    pub(super) fn columns_within(&self, out: usize) -> std::ops::Range<usize> {
        let Region { row, nx, .. } = self.region;
        row.saturating_sub(out)..(row + out).min(nx)
    }

    /// The bands that a layer reaches into, each with the metres of it that lie there. What lies below the ground at the row's axis, as on a slope, is of the lowest.
    pub(super) fn bands_of(&self, [from_m, to_m]: [f64; 2]) -> impl Iterator<Item = (usize, f64)> {
        let Self { band_m, count, .. } = *self;
        let first = (from_m / band_m).max(0.0) as usize;
        let last = ((to_m / band_m).max(0.0) as usize).min(count.saturating_sub(1));
        (first..=last).map(move |band| {
            let low_m = if band == 0 { f64::NEG_INFINITY } else { band as f64 * band_m };
            let high_m = (band + 1) as f64 * band_m;
            (band, (to_m.min(high_m) - from_m.max(low_m)).max(0.0))
        })
    }

    /// Lower and upper face of a layer, metres.
    pub(super) fn layer_m(&self, layer: usize) -> [f64; 2] {
        [layer, layer + 1].map(|face| self.region.z_m + face as f64 * self.region.dz_m)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::parameters::Parameters;
    use crate::voxels::Voxels;
    use rowscan_protocol::rig::{Mount, Rig};

    pub(in crate::by_height) fn ladder(band_m: f64) -> Ladder {
        let frame = Frame::new(&Rig::default(), &Mount::default()).unwrap();
        let voxels = Voxels::new(&frame, Some(4.0), &Parameters::default());
        Ladder::new(band_m, voxels.region(), &frame).unwrap()
    }

    #[test]
    fn every_layer_is_shared_out_whole_and_every_band_has_its_heights() {
        for band_m in [0.1, 0.15, 0.25, 0.3, 0.5] {
            let ladder = ladder(band_m);
            let mut of_bands = vec![0.0; ladder.count];
            for layer in 0..ladder.region.nz {
                let faces_m = ladder.layer_m(layer);
                let sum: f64 = ladder.bands_of(faces_m).map(|(_, part_m)| part_m).sum();
                assert!((sum - ladder.region.dz_m).abs() < 1e-9, "{band_m}: layer {layer}: {sum}");
                ladder.bands_of(faces_m).for_each(|(band, part_m)| of_bands[band] += part_m);
            }
            // The first band lacks what the ground's clearance is, the last one what is above the voxels.
            for (band, found_m) in of_bands.iter().enumerate() {
                let [low_m, high_m] = ladder.edges_m(band);
                let expected_m = (high_m.min(5.0) - low_m.max(0.1)).max(0.0);
                assert!((found_m - expected_m).abs() < 1e-9, "{band_m}: band {band}: {found_m}");
            }
        }
    }

    #[test]
    fn columns_are_told_by_how_far_they_are_from_the_row_plane() {
        let ladder = ladder(0.25);
        let row = ladder.region.row;
        assert_eq!((ladder.columns_out(row), ladder.columns_out(row - 1)), (1, 1));
        for column in 0..ladder.region.nx {
            let within = ladder.columns_within(ladder.columns_out(column));
            assert!(within.contains(&column), "{column}: {within:?}");
            let nearer = ladder.columns_within(ladder.columns_out(column) - 1);
            assert!(!nearer.contains(&column), "{column}: {nearer:?}");
        }
    }

    #[test]
    fn a_band_that_is_too_low_or_too_high_is_refused() {
        let frame = Frame::new(&Rig::default(), &Mount::default()).unwrap();
        let region = Voxels::new(&frame, Some(4.0), &Parameters::default()).region();
        for band_m in [0.0, 0.09, 0.51, f64::NAN, -1.0] {
            assert!(Ladder::new(band_m, region, &frame).is_err(), "{band_m}");
        }
    }
}
