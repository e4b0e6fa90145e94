//! Where beams go: angles into the scene frame, the area a beam stands for, and which returns are canopy.
//!
//! Everything that depends on the beam alone is tabled once per beam grid. The frame here is the sensor's: x from the
//! mirror towards the row (the row axis is at the mount's distance), z above the ground at the row axis. On a slope the ground is a line through that
//! point; what lies below it or within the rig's clearance of it is no canopy.

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Attitude, Axes, Mount, Rig};
use rowscan_protocol::scan::NO_ECHO;

use crate::across::LOWEST_M;
use crate::error::PipelineError;
use crate::parameters::AreaForm;

/// No range is longer than this, metres: twice what 16-bit millimetres with scale factor 2 hold, and still no overflow.
pub(crate) const MAX_RANGE_M: f64 = 1000.0;

/// The mount and what bounds the row, checked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// θ = sense · α + offset, degrees.
    pub(crate) sense: f64,
    pub(crate) offset_deg: f64,
    /// Of the mirror above the ground at the row axis.
    pub(crate) height_m: f64,
    pub(crate) distance_m: f64,
    /// How much the ground rises a metre towards the row; 0 where it is level.
    pub(crate) rise: f64,
    /// Z of the ground at the row axis in the rig's frame: 0 but for rows that stand up or down the slope.
    pub(crate) foot_m: f64,
    /// How far the mirror sits ahead of what the advance is measured of.
    pub(crate) offset_y_m: f64,
    /// The scan plane's axes, where it is believed to lean; roll is in the angles.
    pub(crate) axes: Option<Axes>,
    pub(crate) ground_clearance_m: f64,
    /// Returns at or beyond this x belong to the next row; infinite where the row spacing is unknown.
    pub(crate) far_gate_m: f64,
}

impl Frame {
    pub(crate) fn new(rig: &Rig, mount: &Mount) -> Result<Self, PipelineError> {
        rig.validate()?;
        let (sense, offset_deg) = mount.angle_map();
        let attitude = mount.attitude();
        // To the tractor's right, with X.
        let rise = rig.ground_slope_deg.unwrap_or(0.0).to_radians().tan();
        let foot_m = rise * rig.row_axis_m(mount, None);
        Ok(Self {
            sense,
            offset_deg: offset_deg - mount.roll_deg,
            offset_y_m: mount.offset_y_m,
            axes: attitude.leans().then(|| Attitude { roll_rad: 0.0, ..attitude }.axes()),
            height_m: mount.height_m - foot_m,
            distance_m: mount.distance_m,
            rise: mount.side() * rise,
            foot_m,
            ground_clearance_m: rig.ground_clearance_m,
            far_gate_m: rig.row_spacing_m.map_or(f64::INFINITY, |spacing| mount.distance_m + spacing / 2.0),
        })
    }
}

/// One beam of a grid: its direction in the scan plane and the area it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Beam {
    pub(crate) cos: f64,
    pub(crate) sin: f64,
    /// Angle from +X, up positive, radians.
    pub(crate) theta_rad: f64,
    /// ΔA = weight · range · this: 2 sin(Δθ/2) cos θ, or |sin(θ + Δθ) − sin θ|.
    pub(crate) area_factor: f64,
    /// Along the row, a metre of the beam; 0 where the plane is square to it.
    pub(crate) ahead: f64,
    /// How far along the row, from its line, the beam crosses the row's middle.
    pub(crate) shift_m: f64,
}

/// Beams that cross the row's middle farther off than so many times its distance are taken to end there: they are above all canopy, or in
/// the ground.
const FARTHEST: f64 = 2.0;

impl Beam {
    /// How far a metre of the beam goes in the plane across the row, metres: 1 where the scan plane does not lean.
    pub(crate) fn across(&self) -> f64 {
        (1.0 - self.ahead * self.ahead).sqrt()
    }

    /// The same beam in a plane with these axes; None if it does not look at the row. What it stands for is as high as the beams are apart,
    /// and as long as the row that the line stands for, however the plane leans.
    fn leaning(self, axes: &Axes, distance_m: f64) -> Option<Self> {
        let [cos, ahead, sin] = axes.beam(self.cos, self.sin);
        let [.., upright] = axes.up;
        (cos > 1e-9).then(|| Self {
            cos,
            sin,
            theta_rad: sin.atan2(cos),
            area_factor: self.area_factor * upright,
            ahead,
            shift_m: ahead * (distance_m / cos).min(FARTHEST * distance_m),
        })
    }
}

/// The beams of a grid; those that do not look ahead (|θ| ≥ 90°) are None.
#[derive(Clone, Debug, Default)]
pub(crate) struct BeamTable {
    grid: BeamGrid,
    beams: Vec<Option<Beam>>,
}

impl BeamTable {
    /// Fits the table to a grid; true if it had to be rebuilt.
    pub(crate) fn update(&mut self, grid: BeamGrid, frame: &Frame, form: AreaForm) -> bool {
        if grid == self.grid {
            return false;
        }
        self.grid = grid;
        self.beams.clear();
        let step = grid.step_deg().to_radians();
        self.beams.extend((0..grid.len()).map(|i| {
            let theta_deg = frame.sense * grid.angle_deg(i) + frame.offset_deg;
            if theta_deg.abs() >= 90.0 {
                return None;
            }
            let theta = theta_deg.to_radians();
            let (sin, cos) = theta.sin_cos();
            let area_factor = match form {
                AreaForm::Midpoint => 2.0 * (step / 2.0).sin() * cos,
                AreaForm::Forward => frame.sense * ((theta + frame.sense * step).sin() - sin),
            };
            let upright = Beam { cos, sin, theta_rad: theta, area_factor, ahead: 0.0, shift_m: 0.0 };
            match &frame.axes {
                None => Some(upright),
                Some(axes) => upright.leaning(axes, frame.distance_m),
            }
        }));
        true
    }

    #[cfg(test)]
    pub(crate) fn capacity(&self) -> usize {
        self.beams.capacity()
    }

    /// The grid that it is of.
    pub(crate) fn grid(&self) -> BeamGrid {
        self.grid
    }

    pub(crate) fn beams(&self) -> &[Option<Beam>] {
        &self.beams
    }
}

/// What a range reading is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reading {
    /// A return.
    Return,
    /// No echo: the beam met nothing.
    Miss,
    /// No range at all.
    Invalid,
}

/// Tells returns from misses and from nonsense.
pub(crate) fn reading(range_m: f64) -> Reading {
    if range_m == NO_ECHO {
        Reading::Miss
    } else if range_m > 0.0 && range_m <= MAX_RANGE_M {
        Reading::Return
    } else {
        Reading::Invalid
    }
}

/// How far a beam goes, metres: endless where it met nothing, not a number where nobody knows.
pub(crate) fn depth_m(range_m: f64) -> f64 {
    match reading(range_m) {
        Reading::Return => range_m,
        Reading::Miss => f64::INFINITY,
        Reading::Invalid => f64::NAN,
    }
}

/// Where a return belongs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// In the scanned row, at x from the sensor and z above ground.
    Canopy {
        x_m: f64,
        z_m: f64,
    },
    Ground,
    Far,
}

impl Frame {
    /// Height above the ground below, metres.
    pub(crate) fn above_ground_m(&self, x_m: f64, z_m: f64) -> f64 {
        z_m - self.rise * (x_m - self.distance_m)
    }

    /// How far across the row a beam of this depth ends, metres; `None` where it meets nothing, ends among low growth, or reaches the next row.
    pub(crate) fn crown_x_m(&self, beam: &Beam, depth_m: f64) -> Option<f64> {
        let x_m = depth_m * beam.cos;
        let above_m = self.above_ground_m(x_m, self.height_m + depth_m * beam.sin);
        (depth_m.is_finite() && x_m < self.far_gate_m && above_m >= LOWEST_M).then_some(x_m)
    }

    /// The part of a beam, metres from the mirror, that lies above the ground's clearance; empty where all of it lies in the ground.
    pub(crate) fn above_clearance_m(&self, beam: &Beam) -> (f64, f64) {
        let mirror_m = self.above_ground_m(0.0, self.height_m) - self.ground_clearance_m;
        let gain = beam.sin - self.rise * beam.cos;
        if gain.abs() < 1e-12 {
            (0.0, if mirror_m >= 0.0 { f64::INFINITY } else { 0.0 })
        } else if gain < 0.0 {
            (0.0, -mirror_m / gain)
        } else {
            (-mirror_m / gain, f64::INFINITY)
        }
    }

    /// Where the return at `range_m` along a beam belongs. Ground is looked at first.
    pub(crate) fn place(&self, beam: &Beam, range_m: f64) -> Place {
        let x_m = range_m * beam.cos;
        let z_m = self.height_m + range_m * beam.sin;
        if self.above_ground_m(x_m, z_m) < self.ground_clearance_m {
            Place::Ground
        } else if x_m >= self.far_gate_m {
            Place::Far
        } else {
            Place::Canopy { x_m, z_m }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::rig::{Orientation, Roof, RowSide};

    fn table(mount: &Mount, grid: BeamGrid, form: AreaForm) -> BeamTable {
        let frame = Frame::new(&Rig::default(), mount).unwrap();
        let mut table = BeamTable::default();
        assert!(table.update(grid, &frame, form));
        assert!(!table.update(grid, &frame, form));
        table
    }

    #[test]
    fn only_beams_that_look_ahead_count() {
        // −45°..225° at 0.5°: 541 beams, of which −89.5°..89.5° look at the row.
        let grid = BeamGrid::spanning(-450_000, 2_250_000, 5000);
        let side = table(&Mount::default(), grid, AreaForm::Midpoint);
        assert_eq!(side.beams().iter().flatten().count(), 359);
        // Up: −45°..89.5° on either side.
        for row in [RowSide::Right, RowSide::Left] {
            let up = table(
                &Mount { orientation: Orientation::Up, row, ..Mount::default() },
                grid,
                AreaForm::Midpoint,
            );
            assert_eq!(up.beams().iter().flatten().count(), 270);
        }
    }

    #[test]
    fn areas_are_positive_whichever_way_the_roof_looks() {
        let grid = BeamGrid::spanning(0, 1_800_000, 5000);
        for form in [AreaForm::Midpoint, AreaForm::Forward] {
            let backward = table(&Mount { roof: Some(Roof::Backward), ..Mount::default() }, grid, form);
            let forward = table(&Mount { roof: Some(Roof::Forward), ..Mount::default() }, grid, form);
            let sum = |t: &BeamTable| t.beams().iter().flatten().map(|b| b.area_factor).sum::<f64>();
            // Both telescope or sum to sin 89.5° − sin −89.5° and a step more.
            assert!((sum(&forward) - 2.0).abs() < 1e-3, "{}", sum(&forward));
            // The table of a roof that looks back is the other one, mirrored: the same beams in the other order.
            let up = |t: &BeamTable| t.beams().iter().map(|b| b.map(|b| b.sin)).collect::<Vec<_>>();
            let mut mirrored = up(&backward);
            mirrored.reverse();
            for (a, b) in up(&forward).iter().zip(&mirrored) {
                assert!((a.unwrap_or(9.0) - b.unwrap_or(9.0)).abs() < 1e-12);
            }
            assert!((sum(&forward) - sum(&backward)).abs() < 2e-2);
        }
    }

    #[test]
    fn readings_that_are_no_ranges_are_neither_return_nor_miss() {
        assert_eq!(reading(2.5), Reading::Return);
        assert_eq!(reading(NO_ECHO), Reading::Miss);
        for nonsense in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY, 1e300] {
            assert_eq!(reading(nonsense), Reading::Invalid, "{nonsense}");
        }
    }
}
