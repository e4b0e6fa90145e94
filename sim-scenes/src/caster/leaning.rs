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
    /// Between its first and its last beam, where that is a narrow sector.
    wedge: Option<Wedge>,
}

/// The least Y of a plane's normal: no plane is taken for steeper.
const SQUAREST: f64 = 0.05;

/// How far a search along the row is widened, metres: far above rounding.
const SPARE_M: f64 = 1e-6;

/// A wider sector is not looked at closer.
const WIDEST_WEDGE_RAD: f64 = std::f64::consts::FRAC_PI_4;

/// A sector about the origin, across the row: the directions of its edges.
#[derive(Clone, Copy)]
struct Wedge([[f64; 2]; 2]);

impl Wedge {
    /// The corners of the part of a rectangle that lies in it.
    fn corners(self, rectangle: Rectangle) -> impl Iterator<Item = [f64; 2]> {
        let Self([one, other]) = self;
        let low = rectangle.low.map(|low| low - SPARE_M);
        let high = rectangle.high.map(|high| high + SPARE_M);
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let turn = cross(one, other).signum();
        let of_edges = [one, other].into_iter().flat_map(move |edge| {
            let through = passage(edge, low, high);
            through.into_iter().flatten().map(move |t| [t * edge[0], t * edge[1]])
        });
        let of_rectangle = [low, high, [low[0], high[1]], [high[0], low[1]]].into_iter();
        // A corner on an edge is found with the edge as well.
        of_edges.chain(
            of_rectangle.filter(move |corner| {
                turn * cross(one, *corner) >= 0.0 && turn * cross(*corner, other) >= 0.0
            }),
        )
    }
}

/// Where a half-line from the origin enters a rectangle and leaves it, in lengths of `edge`; none where it passes by.
fn passage(edge: [f64; 2], low: [f64; 2], high: [f64; 2]) -> Option<[f64; 2]> {
    let mut through = [0.0, f64::INFINITY];
    for axis in 0..2 {
        let (low, high) = (low[axis], high[axis]);
        if edge[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
            continue;
        }
        let (one, other) = (low / edge[axis], high / edge[axis]);
        through = [through[0].max(one.min(other)), through[1].min(one.max(other))];
    }
    (through[0] <= through[1] && through[1].is_finite()).then_some(through)
}

impl<'a> Leaning<'a> {
    pub(super) fn new(fan: &'a BeamFan, axes: &'a Axes) -> Self {
        let is_narrow = fan.step_rad().abs() * fan.len().saturating_sub(1) as f64 <= WIDEST_WEDGE_RAD;
        let edge = |beam: usize| {
            let (cos, sin) = fan.direction(beam);
            let [x, _, z] = axes.beam(cos, sin);
            [x, z]
        };
        let wedge = (is_narrow && !fan.is_empty()).then(|| Wedge([edge(0), edge(fan.len() - 1)]));
        Self { fan, axes, wedge }
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

    /// The plane's Y over the corners of what the beams see of the rectangle.
    fn reach(&self, (from_m, to_m): (f64, f64), rectangle: Rectangle) -> (f64, f64) {
        let [x, y, z] = self.axes.ahead;
        let y = y.max(SQUAREST);
        let rise = |[corner_x, corner_z]: [f64; 2]| -(x * corner_x + z * corner_z) / y;
        if let Some(wedge) = self.wedge {
            let seen = wedge.corners(rectangle).map(rise);
            let (least, most) = seen.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), rise| {
                (least.min(rise), most.max(rise))
            });
            // Nothing of it: where the beams begin.
            let (least, most) = if least <= most { (least, most) } else { (0.0, 0.0) };
            return (from_m + least - SPARE_M, to_m + most + SPARE_M);
        }
        let Rectangle { low, high } = rectangle;
        let corners = [low, high, [low[0], high[1]], [high[0], low[1]]];
        let rises = corners.map(rise);
        let finite = || rises.into_iter().filter(|rise| rise.is_finite());
        let (least, most) = (finite().fold(0.0, f64::min), finite().fold(0.0, f64::max));
        (from_m + least - SPARE_M, to_m + most + SPARE_M)
    }
}
