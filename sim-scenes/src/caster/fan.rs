//! The beams of one mirror turn: evenly spaced directions in the scan plane.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::Mount;

use crate::angle::cos_sin_deg;

/// Evenly spaced beam directions, up to a full circle or beyond. θ in radians from +X, positive up.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamFan {
    start_rad: f64,
    step_rad: f64,
    cos: Vec<f64>,
    sin: Vec<f64>,
}

impl BeamFan {
    /// `count` beams: beam `j` at `start_deg + j · step_deg` (degrees; the step may be negative).
    ///
    /// Angles are kept in degrees until each is converted, so that a beam at exactly 0° is horizontal. A step that is zero
    /// or no number gives an empty fan.
    pub fn from_degrees(start_deg: f64, step_deg: f64, count: usize) -> Self {
        let usable = start_deg.is_finite() && step_deg.is_finite() && step_deg != 0.0;
        let thetas = (0..if usable { count } else { 0 }).map(|j| start_deg + j as f64 * step_deg);
        let (cos, sin) = thetas.map(cos_sin_deg).unzip();
        Self { start_rad: start_deg * (PI / 180.0), step_rad: step_deg * (PI / 180.0), cos, sin }
    }

    /// The beams of a scanner's mirror as mounted.
    pub fn of_mount(mount: &Mount, grid: BeamGrid) -> Self {
        let (sense, offset_deg) = mount.angle_map();
        Self::from_degrees(sense * grid.angle_deg(0) + offset_deg, sense * grid.step_deg(), grid.len())
    }

    /// Number of beams.
    pub fn len(&self) -> usize {
        self.cos.len()
    }

    /// True if there is no beam.
    pub fn is_empty(&self) -> bool {
        self.cos.is_empty()
    }

    /// θ of beam `j`, radians.
    pub fn theta_rad(&self, j: usize) -> f64 {
        self.start_rad + j as f64 * self.step_rad
    }

    /// (cos θ, sin θ) of every beam, in order.
    pub fn directions(&self) -> impl ExactSizeIterator<Item = (f64, f64)> + '_ {
        self.cos.iter().copied().zip(self.sin.iter().copied())
    }
}

/// How far (in beams) an interval is widened: far above rounding, far below anything that costs time.
const MARGIN: f64 = 1e-6;

impl BeamFan {
    /// Calls `visit` with every run of beams whose θ may lie in [from, from + width] (radians), modulo full turns. No beam
    /// within is left out; one just outside may come along.
    pub(super) fn runs(&self, from_rad: f64, width_rad: f64, mut visit: impl FnMut(Range<usize>)) {
        let low_rad = if self.step_rad > 0.0 { from_rad } else { from_rad + width_rad };
        let turn = TAU / self.step_rad.abs();
        let width = (width_rad / self.step_rad.abs()).min(turn);
        let count = self.len();
        // First the turn whose interval may still reach beam 0, then on turn by turn while it begins within the fan.
        let low = (low_rad - self.start_rad) / self.step_rad - MARGIN;
        let mut low = low - turn * ((low + width + 2.0 * MARGIN) / turn).floor();
        while low < count as f64 {
            let from = low.ceil().max(0.0) as usize;
            let to = ((low + width + 2.0 * MARGIN).floor() + 1.0).clamp(0.0, count as f64) as usize;
            if from < to {
                visit(from..to);
            }
            low += turn;
        }
    }

    /// Cosines and sines of a run of beams.
    pub(super) fn cos_sin(&self, run: Range<usize>) -> (&[f64], &[f64]) {
        (self.cos.get(run.clone()).unwrap_or(&[]), self.sin.get(run).unwrap_or(&[]))
    }
}
