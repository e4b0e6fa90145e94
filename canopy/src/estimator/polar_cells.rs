//! Polar cells about the scanner: who entered, who ended there. What the polar density and the tree area index are made of.
//!
//! A cell lies between two ranges and two angles about the scanner as one looks along the row, over some slices along it; it belongs to the row if
//! its middle does (above the ground clearance, below the region's top, before the far gate). A beam enters a cell if the canopy did not
//! stop it before, and ends there if it did within. Where the scan plane leans, a beam's way through a cell is longer than that cell is.

use super::contract::{Setting, SightedLine};
use crate::delays::Delays;
use crate::geometry::Frame;

/// Length of a cell along the beam, metres.
const STEP_M: f64 = 0.25;
/// Cells over the half circle ahead: 3° each.
pub(super) const SECTORS: usize = 60;
/// Length of a cell along the row, metres, about: long enough for many beams, short enough not to mix trees.
const STRETCH_M: f64 = 0.74;
/// No cell lies farther than this, metres.
const MAX_RANGE_M: f64 = 12.0;

#[derive(Clone, Debug)]
pub(super) struct PolarCells {
    cells: Vec<Cell>,
    rings: usize,
    /// By ring: how many times as often as a ray a beam meets a leaf.
    inflation: Vec<f64>,
    delays: Delays,
    min_beams: f64,
    length_m: f64,
    hits: f64,
    patches: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    inside: bool,
    entered: f64,
    ended: f64,
    /// Sum over those that entered of [`Beam::across`](crate::geometry::Beam::across).
    across: f64,
}

/// What a stretch of cells holds, and how it was seen.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PolarSums {
    /// Σ a · r Δr Δθ Δy with a the attenuation, a metre: the area projected on the beams (G = 1), m².
    pub(super) projected_m2: f64,
    /// Cells entered by enough beams.
    pub(super) entered: u64,
    /// Of those, the ones in which every beam ended.
    pub(super) saturated: u64,
}

impl PolarCells {
    pub(super) fn new(setting: &Setting) -> Self {
        let Setting { frame, parameters, .. } = setting;
        let far_m = if frame.far_gate_m.is_finite() { frame.far_gate_m } else { 2.0 * frame.distance_m };
        let up_m = (parameters.top_m - frame.height_m).abs().max(frame.height_m);
        let rings = (far_m.hypot(up_m).min(MAX_RANGE_M) / STEP_M).ceil().max(1.0) as usize;
        let mut cells = vec![Cell::default(); rings * SECTORS];
        for (i, cell) in cells.iter_mut().enumerate() {
            let range_m = ((i % rings) as f64 + 0.5) * STEP_M;
            let theta = sector_middle(i / rings);
            cell.inside =
                inside(frame, parameters.top_m, far_m, range_m * theta.cos(), range_m * theta.sin());
        }
        Self {
            cells,
            rings,
            inflation: (0..rings).map(|ring| parameters.inflation((ring as f64 + 0.5) * STEP_M)).collect(),
            delays: Delays::new(parameters),
            min_beams: f64::from(parameters.min_beams.max(1)),
            length_m: 0.0,
            hits: 0.0,
            patches: 0.0,
        }
    }

    pub(super) fn line(&mut self, line: &SightedLine<'_>) {
        self.length_m += line.weight_m;
        for sighting in line.sightings {
            let first = sector(sighting.beam.theta_rad) * self.rings;
            let across = sighting.beam.across();
            let end = sighting.canopy.map_or(self.rings, |contact| {
                let nearest_m = contact.range_m - self.delays.at(contact.range_m);
                (nearest_m.max(0.0) * across / STEP_M) as usize
            });
            let Some(cells) = self.cells.get_mut(first..first + self.rings) else { continue };
            for cell in cells.iter_mut().take(end + 1) {
                cell.entered += 1.0;
                cell.across += across;
            }
            if let Some((cell, contact)) =
                cells.get_mut(end).zip(sighting.canopy).filter(|(cell, _)| cell.inside)
            {
                cell.ended += 1.0;
                self.hits += 1.0;
                self.patches += f64::from(u8::from(contact.fresh));
            }
        }
    }

    /// A slice ends: the sums of the stretch of row that ends with it, if it is long enough.
    pub(super) fn slice(&mut self) -> PolarSums {
        if self.length_m >= STRETCH_M { self.close() } else { PolarSums::default() }
    }

    /// The sums of what is open.
    pub(super) fn open(&self) -> PolarSums {
        self.clone().close()
    }

    /// Ends the stretch.
    pub(super) fn close(&mut self) -> PolarSums {
        let mut sums = PolarSums::default();
        // Each patch stands for one look: half a look is what the correction adds.
        let half = 0.5 * (self.hits / self.patches.max(1.0)).max(1.0);
        for (i, cell) in self.cells.iter_mut().enumerate() {
            if cell.inside && cell.entered >= self.min_beams {
                sums.entered += 1;
                sums.saturated += u64::from(cell.ended >= cell.entered);
                let passed = (cell.entered - cell.ended + half) / (cell.entered + half);
                let range_m = ((i % self.rings) as f64 + 0.5) * STEP_M;
                // a · r Δr Δθ Δy, with a = −ln(passed) / the beam's way, Δr / across.
                let sector = std::f64::consts::PI / SECTORS as f64;
                let inflation = self.inflation.get(i % self.rings).copied().unwrap_or(1.0);
                let across = cell.across / cell.entered;
                sums.projected_m2 += -passed.ln() / inflation * range_m * sector * self.length_m * across;
            }
            (cell.entered, cell.ended, cell.across) = (0.0, 0.0, 0.0);
        }
        (self.length_m, self.hits, self.patches) = (0.0, 0.0, 0.0);
        sums
    }
}

impl std::ops::AddAssign for PolarSums {
    fn add_assign(&mut self, other: Self) {
        self.projected_m2 += other.projected_m2;
        self.entered += other.entered;
        self.saturated += other.saturated;
    }
}

/// The sector that a beam lies in.
pub(super) fn sector(theta_rad: f64) -> usize {
    (((theta_rad / std::f64::consts::PI + 0.5) * SECTORS as f64) as usize).min(SECTORS - 1)
}

fn sector_middle(sector: usize) -> f64 {
    ((sector as f64 + 0.5) / SECTORS as f64 - 0.5) * std::f64::consts::PI
}

fn inside(frame: &Frame, top_m: f64, far_m: f64, x_m: f64, up_m: f64) -> bool {
    let z_m = frame.height_m + up_m;
    x_m < far_m && z_m < top_m && frame.above_ground_m(x_m, z_m) > frame.ground_clearance_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sectors_lie_evenly_about_the_horizontal() {
        let step = std::f64::consts::PI / SECTORS as f64;
        assert!((sector_middle(SECTORS / 2) - step / 2.0).abs() < 1e-12);
        for sector in 0..SECTORS {
            assert!((sector_middle(sector) + sector_middle(SECTORS - 1 - sector)).abs() < 1e-12);
        }
    }
}
