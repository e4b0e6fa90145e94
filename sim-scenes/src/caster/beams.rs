//! Beams of one line: a mirror's fan, or parallel beams of an orthogonal scan.

use std::ops::Range;

use rowscan_protocol::scan::Pose;

use super::fan::BeamFan;

/// The beams of one line, all in the plane y = const.
#[derive(Clone, Debug, PartialEq)]
pub enum Beams {
    /// From one point, by angle: the mirror of a scanner.
    Fan(BeamFan),
    /// Side by side, in one direction: the orthogonal scans of the paper.
    Parallel(ParallelBeams),
}

impl Beams {
    /// Number of beams.
    pub fn len(&self) -> usize {
        match self {
            Self::Fan(fan) => fan.len(),
            Self::Parallel(beams) => beams.len(),
        }
    }

    /// True if there is no beam.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where each beam starts and its unit direction (scene frame), for a line cast from `origin`, in order.
    pub fn rays(&self, origin: Pose) -> impl Iterator<Item = ([f64; 3], [f64; 3])> + '_ {
        let start = [origin.x_m, origin.y_m, origin.z_m];
        let (fan, parallel) = match self {
            Self::Fan(fan) => (Some(fan.directions().map(move |(cos, sin)| (start, [cos, 0.0, sin]))), None),
            Self::Parallel(beams) => {
                let (cos, sin) = beams.direction();
                (None, Some((0..beams.len()).map(move |j| (beams.start(start, j), [cos, 0.0, sin]))))
            }
        };
        fan.into_iter().flatten().chain(parallel.into_iter().flatten())
    }
}

impl From<BeamFan> for Beams {
    fn from(fan: BeamFan) -> Self {
        Self::Fan(fan)
    }
}

impl From<ParallelBeams> for Beams {
    fn from(beams: ParallelBeams) -> Self {
        Self::Parallel(beams)
    }
}

/// Evenly spaced parallel beams. Beam `j` starts `offset_m + j · step_m` from the line's origin, along +Z or +X.
#[derive(Clone, Debug, PartialEq)]
pub struct ParallelBeams {
    view: View,
    step_m: f64,
    offsets: Vec<f64>,
    ones: Vec<f64>,
}

/// Direction of parallel beams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum View {
    Lateral,
    Opposite,
    Zenith,
}

impl ParallelBeams {
    /// Level beams towards +X, beam `j` starting at Z = origin's Z + `offset_m` + `j · step_m`.
    pub fn lateral(offset_m: f64, step_m: f64, count: usize) -> Self {
        Self::new(View::Lateral, offset_m, step_m, count)
    }

    /// Level beams towards −X, from the other side of the row; starts as those of [`ParallelBeams::lateral`].
    pub fn opposite(offset_m: f64, step_m: f64, count: usize) -> Self {
        Self::new(View::Opposite, offset_m, step_m, count)
    }

    /// Beams straight down, beam `j` starting at X = origin's X + `offset_m` + `j · step_m`.
    pub fn zenith(offset_m: f64, step_m: f64, count: usize) -> Self {
        Self::new(View::Zenith, offset_m, step_m, count)
    }

    /// A step that is zero or no number gives no beams.
    fn new(view: View, offset_m: f64, step_m: f64, count: usize) -> Self {
        let usable = offset_m.is_finite() && step_m.is_finite() && step_m != 0.0;
        let count = if usable { count } else { 0 };
        let offsets = (0..count).map(|j| offset_m + j as f64 * step_m).collect();
        Self { view, step_m, offsets, ones: vec![1.0; count] }
    }

    /// Number of beams.
    pub fn len(&self) -> usize {
        self.offsets.len()
    }

    /// True if there is no beam.
    pub fn is_empty(&self) -> bool {
        self.offsets.is_empty()
    }

    /// Where beam `j` starts from the line's origin, metres along +Z or +X; NaN where there is no such beam.
    pub fn offset_m(&self, j: usize) -> f64 {
        self.offsets.get(j).copied().unwrap_or(f64::NAN)
    }

    /// Distance between neighbours, metres; negative where later beams start lower.
    pub fn step_m(&self) -> f64 {
        self.step_m
    }

    /// Direction of all beams, (X, Z).
    pub fn direction(&self) -> (f64, f64) {
        match self.view {
            View::Lateral => (1.0, 0.0),
            View::Opposite => (-1.0, 0.0),
            View::Zenith => (0.0, -1.0),
        }
    }

    /// The axis along which the starts step, (X, Z).
    pub(super) fn across(&self) -> (f64, f64) {
        match self.view {
            View::Lateral | View::Opposite => (0.0, 1.0),
            View::Zenith => (1.0, 0.0),
        }
    }

    /// (1, offset) of a run of beams.
    pub(super) fn ones_offsets(&self, run: Range<usize>) -> (&[f64], &[f64]) {
        (self.ones.get(run.clone()).unwrap_or(&[]), self.offsets.get(run).unwrap_or(&[]))
    }

    /// Start of beam `j`.
    pub(super) fn start(&self, [x, y, z]: [f64; 3], j: usize) -> [f64; 3] {
        let (offset, (along_x, along_z)) = (self.offset_m(j), self.across());
        [x + offset * along_x, y, z + offset * along_z]
    }
}
