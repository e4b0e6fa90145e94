//! How close together leaves stand, measured from the scans themselves, and what it makes of hits by beams with a width.
//!
//! A spot meets a leaf wherever it touches its rim. Leaves of a clump share their rims, so the fewer rims, the more leaf a hit stands for ([`Footprint`](crate::Footprint)
//! has a constant κ for it). Two measures of the same scans tell how the leaves of a row stand:
//!
//! - *cells*: contact in cells of twice the voxels' edge over that in the voxels. What is clumped at that size counts for less in larger cells (contact at
//!   several resolutions; Pimont et al. 2018 have the bias).
//! - *closed*: contact of blocks of beams over two spots, which end where all their beams do, over that of the beams. Small surfaces and gaps of the size of a
//!   spot are lost, large ones stay (the size distribution of gaps; Chen and Cihlar 1995, Lang and Xiang 1986).
//!
//! Raw leaf areas are multiplied by exp(constant + a ln cells + b ln closed). The law is fitted on rows of six training systems, by `rowscan study clumping`.

use serde::Serialize;

use crate::clumping_law::ClumpingLaw;
use crate::contact::density;
use crate::voxels::{Voxel, Voxels};

/// How the leaves of a row stand, and what that makes of its raw leaf area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Clumping {
    /// Contact in cells of twice the voxels' edge over that in the voxels.
    pub cells: f64,
    /// Contact of blocks of beams that end where all of them do over that of the beams.
    pub closed: f64,
    /// What raw leaf areas are multiplied by; `None` where no law was fitted for such optics, or the calibration was made without one.
    pub factor: Option<f64>,
}

/// What the measures are made of, summed over slices: raw leaf areas of the voxels that enough beams entered, m² over G.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ClumpingSums {
    by_voxel: f64,
    by_cell: f64,
    closed: f64,
}

impl ClumpingSums {
    /// Of the open slice as it stands.
    pub(crate) fn of(voxels: &Voxels) -> Self {
        if !voxels.closes() {
            return Self::default();
        }
        let (region, min_beams) = (voxels.region(), voxels.min_beams());
        // The row plane is a face of cells, too.
        let first = region.row % 2;
        let mut sums = Self::default();
        for (band, above) in voxels.layer_pairs() {
            for cell in 0..=(region.nx + first) / 2 {
                let columns = (2 * cell).saturating_sub(first)..(2 * cell + 2 - first).min(region.nx);
                let mut of_cell = CellSum::default();
                for place in columns.flat_map(|column| [column, column + region.nx]) {
                    if let Some((voxel, above)) = band.get(place).zip(above.get(place)) {
                        of_cell.add(voxel, *above, min_beams);
                    }
                }
                sums.by_voxel += of_cell.by_voxel;
                sums.closed += of_cell.closed;
                if of_cell.path_m2 > 0.0 {
                    sums.by_cell += of_cell.above * of_cell.hits_m / of_cell.path_m2;
                }
            }
        }
        sums.times(voxels.volume_m3())
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.by_voxel += other.by_voxel;
        self.by_cell += other.by_cell;
        self.closed += other.closed;
    }

    fn times(self, volume_m3: f64) -> Self {
        let Self { by_voxel, by_cell, closed } = self;
        Self { by_voxel: by_voxel * volume_m3, by_cell: by_cell * volume_m3, closed: closed * volume_m3 }
    }

    /// The measures, and the factor by a law; `None` where nothing was hit, or beams have no width.
    pub(crate) fn measured(&self, law: Option<&ClumpingLaw>) -> Option<Clumping> {
        let measured = self.by_voxel > 0.0 && self.by_cell > 0.0 && self.closed > 0.0;
        let (cells, closed) = (self.by_cell / self.by_voxel, self.closed / self.by_voxel);
        measured.then(|| Clumping { cells, closed, factor: law.map(|law| law.factor(cells, closed)) })
    }
}

/// The voxels of a cell that enough beams entered.
#[derive(Clone, Copy, Debug, Default)]
struct CellSum {
    by_voxel: f64,
    closed: f64,
    hits_m: f64,
    path_m2: f64,
    /// Σ share above the ground.
    above: f64,
}

impl CellSum {
    fn add(&mut self, voxel: &Voxel, above: f64, min_beams: u32) {
        let Some(found) = density(voxel, min_beams).filter(|_| above > 0.0) else { return };
        self.by_voxel += found * above;
        if voxel.closed_path_m2 > 0.0 {
            self.closed += voxel.closed_hits_m / voxel.closed_path_m2 * above;
        }
        self.hits_m += voxel.hits_m;
        self.path_m2 += voxel.path_m2;
        self.above += above;
    }
}
