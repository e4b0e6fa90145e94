//! Where the beams of a grid lead through the voxels of the scan plane.

use crate::delays::Delays;
use crate::geometry::{Beam, Frame, Reading, reading};
use crate::parameters::Parameters;

/// A rectangle of voxels in the scan plane: |x − distance| < half width, ground clearance < z < top. On a slope some reach into the ground, or lie in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Region {
    pub(crate) x_m: f64,
    pub(crate) z_m: f64,
    pub(crate) dx_m: f64,
    pub(crate) dz_m: f64,
    pub(crate) nx: usize,
    pub(crate) nz: usize,
    /// The first column behind the row plane.
    pub(crate) row: usize,
}

/// Half width of the region where no row spacing says more, metres.
const DEFAULT_HALF_WIDTH_M: f64 = 1.5;
/// Widest half width a row spacing asks for, metres.
const MAX_HALF_WIDTH_M: f64 = 5.0;

impl Region {
    pub(super) fn new(frame: &Frame, row_spacing_m: Option<f64>, parameters: &Parameters) -> Self {
        let half_m = parameters.half_width_m.unwrap_or_else(|| {
            row_spacing_m.map_or(DEFAULT_HALF_WIDTH_M, |s| (s / 2.0).min(MAX_HALF_WIDTH_M))
        });
        let height_m = (parameters.top_m - frame.ground_clearance_m).max(0.0);
        // Whole voxels fill the region exactly: their edges are a little shorter than requested. The row plane is a face of voxels, so that each has its
        // mirror image wherever the scanner stands; the nearest may reach behind it.
        let cells = |length_m: f64, edge_m: f64| (length_m / edge_m - 1e-9).ceil().max(1.0);
        let (behind, nz) = (cells(half_m, parameters.voxel_m), cells(height_m, parameters.voxel_m));
        let dx_m = half_m / behind;
        let before = cells(frame.distance_m, dx_m).min(behind);
        Self {
            x_m: frame.distance_m - before * dx_m,
            z_m: frame.ground_clearance_m,
            dx_m,
            dz_m: height_m / nz,
            nx: (before + behind) as usize,
            nz: nz as usize,
            row: before as usize,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.nx * self.nz
    }

    /// Of each voxel, the share that lies above the ground's clearance.
    pub(super) fn above_ground(&self, frame: &Frame) -> Vec<f64> {
        let share = |layer: usize, column: usize| {
            if frame.rise == 0.0 {
                return 1.0;
            }
            let top_m = self.z_m + (layer + 1) as f64 * self.dz_m;
            let above_m = [column, column + 1].map(|face| {
                let x_m = self.x_m + face as f64 * self.dx_m;
                frame.above_ground_m(x_m, top_m) - frame.ground_clearance_m
            });
            mean_within(above_m, self.dz_m) / self.dz_m
        };
        let layers = 0..self.nz;
        layers.flat_map(|layer| (0..self.nx).map(move |column| share(layer, column))).collect()
    }

    /// The voxel column as far behind the row plane as column `ix` lies before it.
    pub(super) fn mirrored(&self, ix: usize) -> Option<usize> {
        let column = (2 * self.row).checked_sub(ix + 1)?;
        (column < self.nx).then_some(column)
    }

    fn voxel(&self, x_m: f64, z_m: f64) -> usize {
        let index = |offset_m: f64, edge_m: f64, n: usize| ((offset_m / edge_m).max(0.0) as usize).min(n - 1);
        index(z_m - self.z_m, self.dz_m, self.nz) * self.nx + index(x_m - self.x_m, self.dx_m, self.nx)
    }
}

/// The mean, from 0 to `most`, of what goes evenly from one value to the other.
fn mean_within([from, to]: [f64; 2], most: f64) -> f64 {
    // The integral of what is held within 0 and `most`.
    let up_to = |value: f64| {
        let held = value.clamp(0.0, most);
        held * held / 2.0 + most * (value - most).max(0.0)
    };
    if (to - from).abs() < 1e-9 { from.clamp(0.0, most) } else { (up_to(to) - up_to(from)) / (to - from) }
}

/// The ways of a grid's beams through the region.
#[derive(Clone, Debug, Default)]
pub(crate) struct Paths {
    /// One a beam.
    pub(super) ways: Vec<Way>,
    pub(super) steps: Vec<Step>,
    pub(super) crossings: Vec<f64>,
    /// True for a voxel that some beam leads to.
    pub(super) aimed: Vec<bool>,
}

/// One beam's way: where it enters, and its steps.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Way {
    pub(super) entry_m: f64,
    pub(super) first: usize,
    pub(super) last: usize,
    /// Metres across the row a metre of the beam.
    pub(super) cos: f64,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub(super) voxel: usize,
    pub(super) exit_m: f64,
    /// How many times as often as a ray the beam meets a leaf here.
    pub(super) inflation: f64,
}

impl Paths {
    pub(super) fn rebuild(
        &mut self,
        beams: &[Option<Beam>],
        frame: &Frame,
        region: &Region,
        parameters: &Parameters,
    ) {
        self.ways.clear();
        self.steps.clear();
        for beam in beams {
            let first = self.steps.len();
            let entry_m = beam.map_or(0.0, |beam| self.walk(&beam, frame, (region, parameters)));
            let cos = beam.map_or(0.0, |beam| beam.cos);
            self.ways.push(Way { entry_m, first, last: self.steps.len(), cos });
        }
        self.aimed.clear();
        self.aimed.resize(region.len(), false);
        for step in &self.steps {
            if let Some(aimed) = self.aimed.get_mut(step.voxel) {
                *aimed = true;
            }
        }
    }

    /// Follows a beam through its voxels to where it ends: `each` gets every step, the free path in it as rays would have it, metres, and the range at
    /// which the beam ends, if it does there. Nothing of a beam that is unknown, or that ends before the region.
    pub(super) fn follow(
        &self,
        way: &Way,
        range_m: f64,
        delays: &Delays,
        mut each: impl FnMut(&Step, f64, Option<f64>),
    ) {
        let end_m = match reading(range_m) {
            Reading::Return => range_m,
            Reading::Miss => f64::INFINITY,
            Reading::Invalid => return,
        };
        let mut from_m = way.entry_m;
        if end_m < from_m {
            return;
        }
        let steps = self.steps.get(way.first..way.last).unwrap_or_default();
        // A blended range lies behind the leaf that was met first; the ground stays where it is.
        let inside = steps.last().is_some_and(|last| end_m < last.exit_m);
        let end_m = if inside { (end_m - delays.at(end_m)).max(from_m) } else { end_m };
        for step in steps {
            let ends = end_m < step.exit_m;
            each(step, (step.exit_m.min(end_m) - from_m) * step.inflation, ends.then_some(end_m));
            if ends {
                return;
            }
            from_m = step.exit_m;
        }
    }

    /// Cuts a beam at every voxel face it crosses, and ends it where it meets the ground's clearance; gives where it enters the region.
    fn walk(&mut self, beam: &Beam, frame: &Frame, (region, parameters): (&Region, &Parameters)) -> f64 {
        let height_m = frame.height_m;
        let across = |k: usize| (region.x_m + k as f64 * region.dx_m) / beam.cos;
        let up = |k: usize| (region.z_m + k as f64 * region.dz_m - height_m) / beam.sin;
        let (mut entry_m, mut exit_m) = (across(0), across(region.nx));
        let level = beam.sin.abs() < 1e-12;
        if level {
            let top_m = region.z_m + region.nz as f64 * region.dz_m;
            if height_m < region.z_m || height_m >= top_m {
                return 0.0;
            }
        } else {
            let (a, b) = (up(0), up(region.nz));
            entry_m = entry_m.max(a.min(b));
            exit_m = exit_m.min(a.max(b));
        }
        let (leaves_ground_m, meets_ground_m) = frame.above_clearance_m(beam);
        entry_m = entry_m.max(leaves_ground_m).max(0.0);
        exit_m = exit_m.min(meets_ground_m);
        if !(exit_m.is_finite() && entry_m < exit_m) {
            return 0.0;
        }
        self.crossings.clear();
        self.crossings.extend((1..region.nx).map(across));
        if !level {
            self.crossings.extend((1..region.nz).map(up));
        }
        self.crossings.retain(|t| *t > entry_m && *t < exit_m);
        self.crossings.sort_unstable_by(f64::total_cmp);
        self.crossings.push(exit_m);
        let mut from_m = entry_m;
        for &to_m in &self.crossings {
            let middle_m = (from_m + to_m) / 2.0;
            if to_m > from_m {
                let voxel = region.voxel(middle_m * beam.cos, height_m + middle_m * beam.sin);
                let inflation = parameters.inflation(middle_m);
                self.steps.push(Step { voxel, exit_m: to_m, inflation });
            }
            from_m = to_m;
        }
        entry_m
    }
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::rig::{Mount, Rig};

    use super::*;
    use crate::geometry::BeamTable;
    use crate::parameters::AreaForm;
    use rowscan_protocol::angle::BeamGrid;

    fn on_slope(deg: f64) -> (Frame, Region) {
        let rig = Rig { ground_slope_deg: Some(deg), ..Rig::default() };
        let frame = Frame::new(&rig, &Mount::default()).unwrap();
        (frame, Region::new(&frame, Some(4.0), &Parameters::default()))
    }

    #[test]
    fn of_a_voxel_counts_what_stands_above_the_ground() {
        for deg in [-30.0, -6.0, 0.0, 6.0, 30.0] {
            let (frame, region) = on_slope(deg);
            let shares = region.above_ground(&frame);
            assert_eq!(shares.len(), region.len());
            // By points, 20 by 20 a voxel.
            for (number, share) in shares.iter().enumerate() {
                let (column, layer) = (number % region.nx, number / region.nx);
                let at = |cell: usize, part: usize| cell as f64 + (part as f64 + 0.5) / 20.0;
                let above = (0..400).filter(|point| {
                    let x_m = region.x_m + at(column, point % 20) * region.dx_m;
                    let z_m = region.z_m + at(layer, point / 20) * region.dz_m;
                    frame.above_ground_m(x_m, z_m) > frame.ground_clearance_m
                });
                assert!(
                    (above.count() as f64 / 400.0 - share).abs() < 0.03,
                    "{deg}: {column}, {layer}: {share}"
                );
            }
            assert_eq!(shares.iter().all(|share| *share == 1.0), deg == 0.0, "{deg}");
        }
    }

    #[test]
    fn no_beam_goes_on_below_the_ground() {
        for deg in [-30.0, -6.0, 0.0, 6.0, 30.0] {
            let (frame, region) = on_slope(deg);
            let (mut table, mut paths) = (BeamTable::default(), Paths::default());
            table.update(BeamGrid::spanning(0, 1_800_000, 5000), &frame, AreaForm::Midpoint);
            paths.rebuild(table.beams(), &frame, &region, &Parameters::default());
            let shares = region.above_ground(&frame);
            assert!(paths.steps.iter().all(|step| shares[step.voxel] > 0.0), "{deg}");
            for (way, beam) in paths.ways.iter().zip(table.beams()) {
                let (Some(beam), Some(last)) =
                    (beam, paths.steps.get(way.first..way.last).and_then(<[Step]>::last))
                else {
                    continue;
                };
                // It may end at the ground's clearance, and not beyond.
                let (x_m, z_m) = (last.exit_m * beam.cos, frame.height_m + last.exit_m * beam.sin);
                assert!(frame.above_ground_m(x_m, z_m) > frame.ground_clearance_m - 1e-9, "{deg}: {beam:?}");
            }
        }
    }

    #[test]
    fn every_column_has_its_mirror_image_wherever_the_scanner_stands() {
        for distance_m in [0.3, 1.0, 1.8, 1.9, 1.95, 2.0, 2.1, 3.0] {
            let frame = Frame::new(&Rig::default(), &Mount { distance_m, ..Mount::default() }).unwrap();
            let region = Region::new(&frame, Some(4.0), &Parameters::default());
            let face_m = region.x_m + region.row as f64 * region.dx_m;
            assert!((face_m - distance_m).abs() < 1e-12, "{distance_m}: the row plane is no face, {face_m}");
            assert_eq!(region.dx_m, 0.25);
            assert!(
                region.x_m > -region.dx_m && region.x_m <= (distance_m - 2.0).max(0.0),
                "{distance_m}: {region:?}"
            );
            let middle_m = |ix: usize| region.x_m + (ix as f64 + 0.5) * region.dx_m - distance_m;
            for ix in 0..region.row {
                let twin = region.mirrored(ix).unwrap();
                assert!((middle_m(twin) + middle_m(ix)).abs() < 1e-12, "{distance_m}: {ix} and {twin}");
                assert_eq!(region.mirrored(twin), Some(ix));
            }
            // Behind the row plane it may reach farther than before it: nothing is seen behind the scanner.
            assert_eq!(region.mirrored(2 * region.row), None);
        }
    }
}
