//! Beams of a scan plane that is not square to the row: a scanner mounted askew, a tractor that pitches.
//!
//! In the plane's own axes all is as for a level fan: the plane is Y = 0, and beams are linear forms in (cos, sin). So organs are seen in those
//! axes; only the ground, the search along the row and the scanner's way, which keep to the scene's, are told apart.

use glam::DVec3;
use pulp::Simd;
use rowscan_protocol::rig::Axes;

use super::fan::BeamFan;
use super::rectangle::Rectangle;
use super::sight::{Cut, Points, Rays, Segments, Sight};
use crate::lanes::Lanes;

/// A fan whose plane has these axes.
#[derive(Clone, Copy)]
pub(super) struct Leaning<'a> {
    fan: &'a BeamFan,
    axes: &'a Axes,
}

/// The least Y of a plane's normal: no plane is taken for steeper.
const SQUAREST: f64 = 0.05;

/// How far a search along the row is widened, metres: far above rounding.
const SPARE_M: f64 = 1e-6;

impl<'a> Leaning<'a> {
    pub(super) fn new(fan: &'a BeamFan, axes: &'a Axes) -> Self {
        Self { fan, axes }
    }
}

impl Sight for Leaning<'_> {
    const FARTHEST: f64 = <BeamFan as Sight>::FARTHEST;
    const ONE_START: bool = true;
    const LEANS: bool = true;

    fn axes(&self) -> &Axes {
        self.axes
    }

    fn count(&self) -> usize {
        self.fan.len()
    }

    fn parameters(&self) -> (&[f64], &[f64]) {
        self.fan.parameters()
    }

    #[inline(always)]
    fn segments<S: Simd>(&self, simd: S, part: usize, cut: Cut<S>, out: &mut Segments) {
        self.fan.segments(simd, part, cut, out);
    }

    /// Starts drift within the plane, too: disks are widened by as much.
    #[inline(always)]
    fn meeting<S: Simd>(&self, middle: Points<S>, radius: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
        let [along, _, up] = self.way();
        let drift_m = libm::hypot(along, up) * self.fan.len() as f64;
        self.fan.meeting(middle, radius + radius.of(drift_m))
    }

    fn turn(&self) -> f64 {
        self.fan.turn()
    }

    fn advance_m(&self) -> f64 {
        self.fan.advance_m()
    }

    #[inline(always)]
    fn rays<S: Simd>(&self, simd: S, p: Lanes<S>, q: Lanes<S>) -> Rays<S> {
        self.fan.rays(simd, p, q)
    }

    #[inline(always)]
    fn key<S: Simd>(simd: S, range_m: Lanes<S>) -> Lanes<S> {
        <BeamFan as Sight>::key(simd, range_m)
    }

    fn direction(&self, j: usize) -> (f64, f64) {
        self.fan.direction(j)
    }

    fn in_scene(&self, (cos, sin): (f64, f64)) -> [f64; 3] {
        self.axes.beam(cos, sin)
    }

    fn ray(&self, j: usize) -> (DVec3, DVec3) {
        let (start, _) = self.fan.ray(j);
        (start, DVec3::from_array(self.in_scene(self.direction(j))))
    }

    /// The plane's Y over the corners of the rectangle.
    fn reach(&self, (from_m, to_m): (f64, f64), Rectangle { low, high }: Rectangle) -> (f64, f64) {
        let [x, y, z] = self.axes.ahead;
        let y = y.max(SQUAREST);
        let corners = [low, high, [low[0], high[1]], [high[0], low[1]]];
        let rises = corners.map(|corner| -(x * corner[0] + z * corner[1]) / y);
        let finite = || rises.into_iter().filter(|rise| rise.is_finite());
        let (least, most) = (finite().fold(0.0, f64::min), finite().fold(0.0, f64::max));
        (from_m + least - SPARE_M, to_m + most + SPARE_M)
    }
}
