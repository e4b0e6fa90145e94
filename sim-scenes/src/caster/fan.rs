//! The beams of one mirror turn: evenly spaced directions in the scan plane.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use pulp::Simd;
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Axes, Mount};

use super::nearest::Nearest;
use super::rectangle::Rectangle;
use super::sight::{Cut, Points, Rays, Segments, Sight};
use crate::angle::cos_sin_deg;
use crate::lanes::{ATAN2_ERROR, Lanes, Row, padded};

/// Evenly spaced beam directions, up to a full circle or beyond. θ in radians from +X, positive up.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamFan {
    start_deg: f64,
    step_deg: f64,
    start_rad: f64,
    step_rad: f64,
    beams_per_rad: f64,
    /// Beams of a whole turn.
    turn: f64,
    turns_per_beam: f64,
    /// The start, within half a turn of 0.
    first_rad: f64,
    advance_m: f64,
    /// The scan plane's, if it leans.
    axes: Option<Axes>,
    count: usize,
    /// Of every beam, padded.
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
        let (cos, sin): (Vec<f64>, Vec<f64>) = thetas.map(cos_sin_deg).unzip();
        let step_rad = step_deg * (PI / 180.0);
        Self {
            start_deg,
            step_deg,
            start_rad: start_deg * (PI / 180.0),
            step_rad,
            beams_per_rad: 1.0 / step_rad,
            turn: TAU / step_rad.abs(),
            turns_per_beam: step_rad.abs() / TAU,
            first_rad: ((start_deg + 180.0).rem_euclid(360.0) - 180.0) * (PI / 180.0),
            advance_m: 0.0,
            axes: None,
            count: cos.len(),
            cos: padded(cos),
            sin: padded(sin),
        }
    }

    /// The same beams from a scanner that moves while its mirror turns: beam `j` starts `j · metres_per_beam` farther along +Y than
    /// beam 0. At speed v and mirror frequency f that is v · |step| / (360° · f). No number counts as standing still.
    #[must_use]
    pub fn advancing(mut self, metres_per_beam: f64) -> Self {
        self.advance(metres_per_beam);
        self
    }

    /// As [`Self::advancing`], in place: the next turn of a mirror whose speed changes.
    pub fn advance(&mut self, metres_per_beam: f64) {
        self.advance_m = if metres_per_beam.is_finite() { metres_per_beam } else { 0.0 };
    }

    /// The same beams in a plane with these axes: θ counts from `to_row` towards `up`.
    #[must_use]
    pub fn leaning(mut self, axes: Axes) -> Self {
        self.lean(Some(axes));
        self
    }

    /// As [`Self::leaning`], in place: the next turn of a mirror whose carrier pitches.
    pub fn lean(&mut self, axes: Option<Axes>) {
        self.axes = axes.filter(|axes| *axes != Axes::LEVEL);
    }

    /// The axes of the scan plane, if it is not square to the row.
    pub fn axes(&self) -> Option<&Axes> {
        self.axes.as_ref()
    }

    /// The beams of a scanner's mirror as mounted on a tractor that drives ahead, its row towards the scene's +X or −X.
    pub fn of_mount(mount: &Mount, grid: BeamGrid, towards_x: bool) -> Self {
        let attitude = mount.attitude();
        let to_row = if towards_x { 1.0 } else { -1.0 };
        if attitude.leans() {
            Self::looking(mount, grid, towards_x).leaning(attitude.axes().in_scene(to_row, 1.0))
        } else {
            Self::tilted(mount, grid, towards_x, -to_row * attitude.roll_rad)
        }
    }

    /// The beams of a scanner's mirror that is mounted level, in the scene's frame: the mount's X points into the vegetation, which is the scene's
    /// +X, or its −X where the tractor has the row on the other side.
    pub fn looking(mount: &Mount, grid: BeamGrid, towards_x: bool) -> Self {
        Self::tilted(mount, grid, towards_x, 0.0)
    }

    /// The same of a vehicle that has rolled by this angle, radians from +X towards +Z.
    pub fn tilted(mount: &Mount, grid: BeamGrid, towards_x: bool, tilt_rad: f64) -> Self {
        let (sense, offset_deg) = mount.angle_map();
        let (sense, offset_deg) = if towards_x { (sense, offset_deg) } else { (-sense, 180.0 - offset_deg) };
        let start_deg = sense * grid.angle_deg(0) + offset_deg + tilt_rad.to_degrees();
        Self::from_degrees(start_deg, sense * grid.step_deg(), grid.len())
    }

    /// The same fan with `fold` rays from beam to beam, and `margin` rays beyond the first and the last beam: beam `j` is ray
    /// `margin + j · fold`. It stands still.
    #[must_use]
    pub fn refined(&self, fold: usize, margin: usize) -> Self {
        let step_deg = self.step_deg / fold.max(1) as f64;
        let count = self.count.checked_sub(1).map_or(0, |gaps| gaps * fold.max(1) + 1 + 2 * margin);
        let fan = Self::from_degrees(self.start_deg - margin as f64 * step_deg, step_deg, count);
        Self { axes: self.axes, ..fan }
    }

    /// `count` beams from beam `first` on, in the same plane. They stand still.
    pub(crate) fn part(&self, first: usize, count: usize) -> Self {
        let start_deg = self.start_deg + first as f64 * self.step_deg;
        Self { axes: self.axes, ..Self::from_degrees(start_deg, self.step_deg, count) }
    }

    /// The same beams about the same middle, with `pitch` times the angle between them.
    pub(super) fn narrowed(self, pitch: f64) -> Self {
        if pitch == 1.0 {
            return self;
        }
        let (step_deg, gaps) = (self.step_deg * pitch, self.count.saturating_sub(1) as f64);
        let start_deg = self.start_deg + (self.step_deg - step_deg) * gaps / 2.0;
        Self { axes: self.axes, ..Self::from_degrees(start_deg, step_deg, self.count) }
    }

    /// Angle from beam to beam, radians; negative where θ falls.
    pub fn step_rad(&self) -> f64 {
        self.step_rad
    }

    /// True if it has the other's beams, whichever way their planes lean.
    pub(crate) fn is_turned_as(&self, other: &Self) -> bool {
        (self.start_deg, self.step_deg, self.count) == (other.start_deg, other.step_deg, other.count)
    }

    /// Number of beams.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if there is no beam.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// θ of beam `j`, radians.
    pub fn theta_rad(&self, j: usize) -> f64 {
        self.start_rad + j as f64 * self.step_rad
    }

    /// (cos θ, sin θ) of every beam, in order.
    pub fn directions(&self) -> impl ExactSizeIterator<Item = (f64, f64)> + '_ {
        self.cos.iter().copied().zip(self.sin.iter().copied()).take(self.count)
    }
}

/// How far (in beams) an interval is widened beyond the error of the arctangent: far above rounding.
const MARGIN: f64 = 1e-6;

/// No less than the angle from one vector to another, by their cross and dot products: by the arctangent's series where it is less than
/// 45°, else half a turn. What is nearer to the scanner than it is long is rare.
#[inline(always)]
fn at_most<S: Simd>(cross: Lanes<S>, dot: Lanes<S>) -> Lanes<S> {
    let tan = cross / dot;
    let square = tan * tan;
    let series = tan * (tan.of(1.0) - square * (tan.of(1.0 / 3.0) - square * tan.of(1.0 / 5.0)));
    cross.lt(dot).select(series, tan.of(PI))
}

impl BeamFan {
    /// Angles θ to θ + width (radians) as beam numbers, widened, and turned so that the first beams to meet come first.
    #[inline(always)]
    fn interval<S: Simd>(&self, from: Lanes<S>, width: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
        let first = if self.step_rad > 0.0 { from } else { from + width };
        let margin = from.of(4.0 * ATAN2_ERROR * self.beams_per_rad.abs() + MARGIN);
        let low = (first - from.of(self.first_rad)) * from.of(self.beams_per_rad) - margin;
        let high = low + width * from.of(self.beams_per_rad.abs()) + margin + margin;
        let shift = (high * from.of(self.turns_per_beam) - from.of(0.5)).round() * from.of(self.turn);
        (low - shift, high - shift)
    }
}

impl Sight for BeamFan {
    const FARTHEST: f64 = 0.0;
    const ONE_START: bool = true;

    fn count(&self) -> usize {
        self.len()
    }

    fn parameters(&self) -> (&[f64], &[f64]) {
        (&self.cos, &self.sin)
    }

    #[inline(always)]
    fn segments<S: Simd>(&self, simd: S, part: usize, cut: Cut<S>, out: &mut Segments) {
        let Cut { a, b, normal, distance, cut } = cut;
        let zero = Lanes::splat(simd, 0.0);
        let cross = a.cross(b);
        // Counter-clockwise from a to b.
        let swap = cross.lt(zero);
        let (a, b) = (Points::select(swap, b, a), Points::select(swap, a, b));
        let met = cut.and(zero.lt(cross.abs())).and(zero.lt(distance.abs()));
        let (low, high) = self.interval(a.angle(), at_most(cross.abs(), a.dot(b)));
        let never = Lanes::splat(simd, f64::INFINITY);
        let nearness = Lanes::splat(simd, 1.0) / distance;
        out.key[0].store(part, normal.0 * nearness);
        out.key[1].store(part, normal.1 * nearness);
        out.from[0].store(part, -a.1);
        out.from[1].store(part, a.0);
        out.to[0].store(part, b.1);
        out.to[1].store(part, -b.0);
        out.spans.set(part, met.select(low, never), high);
    }

    #[inline(always)]
    fn meeting<S: Simd>(&self, middle: Points<S>, radius: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
        let (zero, square) = (radius.of(0.0), middle.dot(middle));
        // Bound on half the angle that a disk takes up: asin x <= x + (π/2 - 1) x³.
        let sine = radius / square.sqrt();
        let half = sine + sine * sine * sine * zero.of(FRAC_PI_2 - 1.0);
        let (from, to) = self.interval(middle.angle() - half, half + half);
        // From within a disk, all beams may.
        let outside = (radius * radius * zero.of(1.0 + 1e-9)).lt(square);
        (outside.select(from, zero), outside.select(to, zero.of(self.len() as f64)))
    }

    fn turn(&self) -> f64 {
        self.turn
    }

    fn advance_m(&self) -> f64 {
        self.advance_m
    }

    #[inline(always)]
    fn rays<S: Simd>(&self, simd: S, p: Lanes<S>, q: Lanes<S>) -> Rays<S> {
        Rays { start: Points(Lanes::splat(simd, 0.0), Lanes::splat(simd, 0.0)), direction: Points(p, q) }
    }

    #[inline(always)]
    fn key<S: Simd>(simd: S, range_m: Lanes<S>) -> Lanes<S> {
        Lanes::splat(simd, 1.0) / range_m
    }

    /// The rectangle's corners bound the beams that may see it; none of them comes nearer than its nearest point.
    fn is_hidden(&self, window: Rectangle, nearest: &Nearest) -> bool {
        let distance_m = window.distance_m();
        if distance_m <= 0.0 || self.is_empty() || self.turn() < self.len() as f64 {
            return false;
        }
        let Rectangle { low, high } = window;
        let middle = [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0];
        let (mut least, mut most) = (0.0f64, 0.0f64);
        for [x, z] in [low, high, [low[0], high[1]], [high[0], low[1]]] {
            let (cross, dot) = (middle[0] * z - middle[1] * x, middle[0] * x + middle[1] * z);
            let turn = libm::atan2(cross, dot);
            (least, most) = (least.min(turn), most.max(turn));
        }
        let one = |value| Lanes::splat(pulp::Scalar::new(), value);
        let from = libm::atan2(middle[1], middle[0]) + least;
        let (first, last) = self.interval(one(from), one(most - least));
        let mut ends = Row::splat(0.0);
        ends.store(0, first);
        ends.store(1, last);
        let ([low, high, ..], last) = (ends.0, (self.len() - 1) as f64);
        // Seen by the last beams and again by the first.
        if low < 0.0 && low + self.turn() <= last {
            return false;
        }
        high < 0.0
            || low > last
            || nearest.all_nearer((low.max(0.0) as usize, high.ceil().min(last) as usize), 1.0 / distance_m)
    }

    #[inline(always)]
    fn direction(&self, j: usize) -> (f64, f64) {
        match (self.cos.get(j), self.sin.get(j)) {
            (Some(cos), Some(sin)) => (*cos, *sin),
            _ => (0.0, 0.0),
        }
    }

    #[inline(always)]
    fn ray(&self, j: usize) -> (DVec3, DVec3) {
        match (self.cos.get(j), self.sin.get(j)) {
            (Some(cos), Some(sin)) if j < self.count => {
                let direction = self.axes.map_or([*cos, 0.0, *sin], |axes| axes.beam(*cos, *sin));
                (DVec3::Y * (j as f64 * self.advance_m), DVec3::from_array(direction))
            }
            _ => (DVec3::ZERO, DVec3::ZERO),
        }
    }
}
