//! What fan and parallel beams have in common: projective coordinates in which a cut leaf is linear.
//!
//! Every beam has two parameters (p, q): (cos θ, sin θ) in a fan, (1, offset) for parallel beams. Along one plane a depth key is
//! linear in them: the inverse range in a fan, minus the range for parallel beams. So is the side of an end of a segment on which
//! the beam passes. Of two surfaces the one with the larger key is nearer.

use glam::DVec3;
use pulp::Simd;
use rowscan_protocol::rig::Axes;

use super::nearest::Nearest;
use super::rectangle::Rectangle;
use super::spans::Spans;
use crate::lanes::{Lanes, Mask, Row};

/// Points or vectors of the scan plane, (X, Z).
#[derive(Clone, Copy)]
pub(super) struct Points<S: Simd>(pub(super) Lanes<S>, pub(super) Lanes<S>);

impl<S: Simd> Points<S> {
    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> Lanes<S> {
        self.0 * other.0 + self.1 * other.1
    }

    /// Positive where `other` lies counter-clockwise.
    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Lanes<S> {
        self.0 * other.1 - self.1 * other.0
    }

    /// Length along a fixed axis.
    #[inline(always)]
    pub(super) fn onto(self, (x, z): (f64, f64)) -> Lanes<S> {
        self.0 * self.0.of(x) + self.1 * self.1.of(z)
    }

    /// θ, as [`Lanes::atan2`] has it.
    #[inline(always)]
    pub(super) fn angle(self) -> Lanes<S> {
        self.1.atan2(self.0)
    }

    #[inline(always)]
    pub(super) fn select(mask: Mask<S>, yes: Self, no: Self) -> Self {
        Self(mask.select(yes.0, no.0), mask.select(yes.1, no.1))
    }
}

/// Eight segments as beams see them: a beam meets one where `from` ≥ 0 and `to` > 0, at depth `key`. Each is a linear form in (p, q).
#[derive(Clone, Debug)]
pub(super) struct Segments {
    pub(super) key: [Row; 2],
    pub(super) from: [Row; 2],
    pub(super) to: [Row; 2],
    /// The beams that may meet it.
    pub(super) spans: Spans,
}

impl Segments {
    pub(super) fn of(sight: &impl Sight) -> Self {
        let rows = [Row::splat(0.0); 2];
        Self { key: rows, from: rows, to: rows, spans: Spans::of(sight.turn(), sight.count()) }
    }
}

/// Eight cut leaves: their ends, the normals of their planes in (X, Z), their distances from the origin along the whole normals.
pub(super) struct Cut<S: Simd> {
    pub(super) a: Points<S>,
    pub(super) b: Points<S>,
    pub(super) normal: Points<S>,
    pub(super) distance: Lanes<S>,
    /// Which of them the plane cuts at all.
    pub(super) cut: Mask<S>,
}

/// Rays of one register of beams: starts from the line's origin and directions, in (X, Z).
pub(super) struct Rays<S: Simd> {
    pub(super) start: Points<S>,
    pub(super) direction: Points<S>,
}

/// Beams that see.
pub(super) trait Sight: Sync {
    /// Key of a surface infinitely far away.
    const FARTHEST: f64;
    /// True if the scan plane is not square to the row.
    const LEANS: bool = false;
    /// Its axes: (X, Z) of what beams see, and Y across it, are along these.
    fn axes(&self) -> &Axes {
        &Axes::LEVEL
    }
    /// Number of beams.
    fn count(&self) -> usize;
    /// True if all beams start in one point, unless the scanner moves.
    const ONE_START: bool;
    /// p and q of all beams, [`padded`](super::lanes::padded).
    fn parameters(&self) -> (&[f64], &[f64]);
    /// Writes part `part` of the segments of `cut`.
    fn segments<S: Simd>(&self, simd: S, part: usize, cut: Cut<S>, out: &mut Segments);
    /// The beams that may meet disks: first and last as in [`Spans::set`].
    fn meeting<S: Simd>(&self, middle: Points<S>, radius: Lanes<S>) -> (Lanes<S>, Lanes<S>);
    /// How many beams on the same interval comes round again; infinite if it does not.
    fn turn(&self) -> f64;
    /// How far the scanner moves along Y from one beam to the next, metres.
    fn advance_m(&self) -> f64;
    /// Rays by their parameters.
    fn rays<S: Simd>(&self, simd: S, p: Lanes<S>, q: Lanes<S>) -> Rays<S>;
    /// Depth keys of ranges, and ranges of keys: each is the other's inverse.
    fn key<S: Simd>(simd: S, range_m: Lanes<S>) -> Lanes<S>;
    /// True if everything within the rectangle is known to lie behind what all beams have met; false where that is not computed.
    fn is_hidden(&self, _: Rectangle, _: &Nearest) -> bool {
        false
    }
    /// Direction of beam `j`, (X, Z) of the plane.
    fn direction(&self, j: usize) -> (f64, f64);
    /// A direction of the plane in the scene.
    #[inline(always)]
    fn in_scene(&self, (x, z): (f64, f64)) -> [f64; 3] {
        [x, 0.0, z]
    }
    /// From one beam's start to the next one's, by the plane's axes.
    fn way(&self) -> [f64; 3] {
        self.axes().seen([0.0, self.advance_m(), 0.0])
    }
    /// The Y at which beams that start between these two may meet what lies within the rectangle, which counts from the line's origin.
    #[inline(always)]
    fn reach(&self, starts_m: (f64, f64), _: Rectangle) -> (f64, f64) {
        starts_m
    }
    /// Start (from the line's origin) and direction of beam `j`.
    fn ray(&self, j: usize) -> (DVec3, DVec3);
}

/// The beams of a line that look from one period of the row, and from where.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// Where beam 0 would start, with Y counted so that `beams` start within [0, period).
    pub(super) origin: [f64; 3],
    /// First beam, and the one after the last.
    pub(super) beams: (usize, usize),
    /// Least and greatest Y at which those beams start.
    pub(super) starts_m: (f64, f64),
    /// And at which they may meet something: other than that only where the plane leans.
    pub(super) y_m: (f64, f64),
}
