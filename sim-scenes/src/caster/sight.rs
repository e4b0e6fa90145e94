//! What fan and parallel beams have in common: projective coordinates in which a cut leaf is linear.
//!
//! Every beam has two parameters (p, q): (cos θ, sin θ) in a fan, (1, offset) for parallel beams. Along one plane a depth key is
//! linear in them: the inverse range in a fan, minus the range for parallel beams. So is the side of an end of a segment on which
//! the beam passes. Of two surfaces the one with the larger key is nearer.

use std::f64::consts::TAU;
use std::ops::Range;

use glam::DVec3;

use super::beams::ParallelBeams;
use super::fan::BeamFan;

/// A point of the scan plane, (X, Z) from the line's origin.
pub(super) type Point = (f64, f64);

/// A linear form in a beam's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Form(pub(super) f64, pub(super) f64);

impl Form {
    pub(super) fn at(self, p: f64, q: f64) -> f64 {
        self.0 * p + self.1 * q
    }
}

/// A segment as beams see it: met where `from` ≥ 0 and `to` > 0, at depth `key`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    pub(super) key: Form,
    pub(super) from: Form,
    pub(super) to: Form,
    /// Where it begins and how far it goes on: radians, or metres of offset.
    pub(super) low: f64,
    pub(super) width: f64,
}

/// The cut leaf's plane: normal in (X, Z) and distance from the origin along the whole normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) normal: Point,
    pub(super) distance: f64,
}

/// Beams that see.
pub(super) trait Sight {
    /// Key of a surface infinitely far away.
    const FARTHEST: f64;
    /// Number of beams.
    fn count(&self) -> usize;
    /// p and q of a run of beams.
    fn parameters(&self, run: Range<usize>) -> (&[f64], &[f64]);
    /// The segment from `a` to `b`; None where no beam can meet it.
    fn segment(&self, a: Point, b: Point, plane: Plane) -> Option<Segment>;
    /// The beams that may meet a disk swept from `a` to `b`: (low, width) as in [`Segment`]; None: all.
    fn swept(&self, a: Point, b: Point, radius: f64) -> Option<(f64, f64)>;
    /// Calls `visit` with every run of beams that may lie in [low, low + width].
    fn runs(&self, low: f64, width: f64, visit: impl FnMut(Range<usize>));
    /// Key of a range along a beam.
    fn key(range_m: f64) -> f64;
    /// The range of a key.
    fn range_m(key: f64) -> f64;
    /// Start (from the line's origin) and direction of beam `j`.
    fn ray(&self, j: usize) -> (DVec3, DVec3);
}

impl Sight for BeamFan {
    const FARTHEST: f64 = 0.0;

    fn count(&self) -> usize {
        self.len()
    }

    fn parameters(&self, run: Range<usize>) -> (&[f64], &[f64]) {
        self.cos_sin(run)
    }

    fn segment(&self, a: Point, b: Point, plane: Plane) -> Option<Segment> {
        let cross = a.0 * b.1 - a.1 * b.0;
        let (a, b) = if cross < 0.0 { (b, a) } else { (a, b) };
        if cross == 0.0 || plane.distance == 0.0 {
            return None;
        }
        Some(Segment {
            key: Form(plane.normal.0 / plane.distance, plane.normal.1 / plane.distance),
            from: Form(-a.1, a.0),
            to: Form(b.1, -b.0),
            low: a.1.atan2(a.0),
            width: cross.abs().atan2(a.0 * b.0 + a.1 * b.1),
        })
    }

    fn swept(&self, a: Point, b: Point, radius: f64) -> Option<(f64, f64)> {
        if distance_to_segment(a, b) <= radius {
            return None;
        }
        let opening = |p: Point| (radius / p.0.hypot(p.1)).min(1.0).asin();
        let turn = (a.0 * b.1 - a.1 * b.0).atan2(a.0 * b.0 + a.1 * b.1);
        let low = (-opening(a)).min(turn - opening(b));
        let high = opening(a).max(turn + opening(b));
        Some((a.1.atan2(a.0) + low, (high - low).min(TAU)))
    }

    fn runs(&self, low: f64, width: f64, visit: impl FnMut(Range<usize>)) {
        self.runs(low, width, visit);
    }

    fn key(range_m: f64) -> f64 {
        1.0 / range_m
    }

    fn range_m(key: f64) -> f64 {
        1.0 / key
    }

    fn ray(&self, j: usize) -> (DVec3, DVec3) {
        let (cos, sin) = self.cos_sin(j..j + 1);
        match (cos, sin) {
            ([cos], [sin]) => (DVec3::ZERO, DVec3::new(*cos, 0.0, *sin)),
            _ => (DVec3::ZERO, DVec3::ZERO),
        }
    }
}

impl Sight for ParallelBeams {
    const FARTHEST: f64 = f64::NEG_INFINITY;

    fn count(&self) -> usize {
        self.len()
    }

    fn parameters(&self, run: Range<usize>) -> (&[f64], &[f64]) {
        self.ones_offsets(run)
    }

    fn segment(&self, a: Point, b: Point, plane: Plane) -> Option<Segment> {
        let (ahead, across) = (self.direction(), self.across());
        let dot = |u: Point, v: Point| u.0 * v.0 + u.1 * v.1;
        let facing = dot(plane.normal, ahead);
        let (range_a, range_b) = (dot(a, ahead), dot(b, ahead));
        if facing == 0.0 || range_a.max(range_b) <= 0.0 {
            return None;
        }
        let (mut at_a, mut at_b) = (dot(a, across), dot(b, across));
        // What lies behind the starts is cut off.
        let start = at_a + (at_b - at_a) * (range_a / (range_a - range_b));
        if range_a <= 0.0 {
            at_a = start;
        } else if range_b <= 0.0 {
            at_b = start;
        }
        let (low, high) = (at_a.min(at_b), at_a.max(at_b));
        Some(Segment {
            key: Form(-plane.distance / facing, dot(plane.normal, across) / facing),
            from: Form(-low, 1.0),
            to: Form(high, -1.0),
            low,
            width: high - low,
        })
    }

    fn swept(&self, a: Point, b: Point, radius: f64) -> Option<(f64, f64)> {
        let across = self.across();
        let (a, b) = (a.0 * across.0 + a.1 * across.1, b.0 * across.0 + b.1 * across.1);
        Some((a.min(b) - radius, (a - b).abs() + 2.0 * radius))
    }

    fn runs(&self, low: f64, width: f64, mut visit: impl FnMut(Range<usize>)) {
        /// As for a fan: far above rounding.
        const MARGIN: f64 = 1e-6;
        let (one, other) =
            ((low - self.offset_m(0)) / self.step_m(), (low + width - self.offset_m(0)) / self.step_m());
        let count = self.len() as f64;
        let from = (one.min(other) - MARGIN).ceil().clamp(0.0, count) as usize;
        let to = ((one.max(other) + MARGIN).floor() + 1.0).clamp(0.0, count) as usize;
        if from < to {
            visit(from..to);
        }
    }

    fn key(range_m: f64) -> f64 {
        -range_m
    }

    fn range_m(key: f64) -> f64 {
        -key
    }

    fn ray(&self, j: usize) -> (DVec3, DVec3) {
        let (cos, sin) = self.direction();
        (DVec3::from_array(self.start([0.0; 3], j)), DVec3::new(cos, 0.0, sin))
    }
}

/// Distance of the origin from a segment.
fn distance_to_segment(a: Point, b: Point) -> f64 {
    let along = (b.0 - a.0, b.1 - a.1);
    let square = along.0 * along.0 + along.1 * along.1;
    let share = if square > 0.0 { (-(a.0 * along.0 + a.1 * along.1) / square).clamp(0.0, 1.0) } else { 0.0 };
    (a.0 + share * along.0).hypot(a.1 + share * along.1)
}
