//! What fan and parallel beams have in common: projective coordinates in which a cut leaf is linear.
//!
//! Every beam has two parameters (p, q): (cos θ, sin θ) in a fan, (1, offset) for parallel beams. Along one plane a depth key is
//! linear in them: the inverse range in a fan, minus the range for parallel beams. So is the side of an end of a segment on which
//! the beam passes. Of two surfaces the one with the larger key is nearer.

use std::ops::Range;

use glam::DVec3;
use pulp::Simd;

use super::lanes::{Lanes, Mask, Row, WIDTH};
use super::nearest::Nearest;
use super::standing::Rectangle;

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
    /// The beams that may meet it, as fractions of beam numbers; infinite where none does.
    pub(super) low: Row,
    pub(super) high: Row,
}

impl Segments {
    pub(super) const NONE: Self = Self {
        key: [Row::splat(0.0); 2],
        from: [Row::splat(0.0); 2],
        to: [Row::splat(0.0); 2],
        low: Row::splat(f64::INFINITY),
        high: Row::splat(f64::INFINITY),
    };
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
    /// Number of beams.
    fn count(&self) -> usize;
    /// p and q of all beams, in rows; the last one filled up with beams that meet nothing.
    fn parameters(&self) -> (&[Row], &[Row]);
    /// Writes part `part` of the segments of `cut`.
    fn segments<S: Simd>(&self, simd: S, part: usize, cut: Cut<S>, out: &mut Segments);
    /// The beams that may meet disks swept from `a` to `b`: low and high as in [`Segments`].
    fn swept<S: Simd>(&self, simd: S, a: Points<S>, b: Points<S>, radius: Lanes<S>) -> (Lanes<S>, Lanes<S>);
    /// How many beams on the same interval comes round again; infinite if it does not.
    fn turn(&self) -> f64;
    /// How far the scanner moves along Y from one beam to the next, metres.
    fn advance_m(&self) -> f64;
    /// Rays by their parameters.
    fn rays<S: Simd>(&self, simd: S, p: Lanes<S>, q: Lanes<S>) -> Rays<S>;
    /// Depth keys of ranges, and back: each its own inverse.
    fn key<S: Simd>(simd: S, range_m: Lanes<S>) -> Lanes<S>;
    /// The range of a key.
    fn range_m(key: f64) -> f64;
    /// True if whatever lies within the rectangle is known to lie behind what all beams have met; false where that is not worked out.
    fn is_hidden(&self, _: Rectangle, _: &Nearest) -> bool {
        false
    }
    /// Start (from the line's origin) and direction of beam `j`.
    fn ray(&self, j: usize) -> (DVec3, DVec3);
}

/// How intervals of beams come round again.
#[derive(Clone, Copy)]
pub(super) struct Turning {
    turn: f64,
    count: f64,
    /// Beams are coarser than half a turn: an interval is all of them.
    coarse: bool,
}

impl Turning {
    #[inline(always)]
    pub(super) fn of(sight: &impl Sight) -> Self {
        let (turn, count) = (sight.turn(), sight.count() as f64);
        Self { turn, count, coarse: turn < 2.0 }
    }

    /// The beams from `low` to `high`, in groups of `GROUP`: none where `low` is infinite.
    #[inline(always)]
    pub(super) fn runs<const GROUP: usize>(self, low: f64, high: f64) -> Runs<GROUP> {
        let Self { turn, count, coarse } = self;
        if coarse && low.is_finite() {
            return Runs { low: 0.0, high: count, turn: count, count, done: 0 };
        }
        Runs { low, high, turn, count, done: 0 }
    }
}

/// The beams of an interval, modulo whole turns, in groups of `GROUP` (1: beams; [`WIDTH`]: rows of beams, all that it touches). No group
/// comes twice: whoever asks tests all beams of a group, and would meet a leaf twice.
pub(super) struct Runs<const GROUP: usize> {
    low: f64,
    high: f64,
    turn: f64,
    count: f64,
    done: usize,
}

impl<const GROUP: usize> Runs<GROUP> {
    /// The next run of groups.
    #[inline(always)]
    pub(super) fn next(&mut self) -> Option<Range<usize>> {
        while self.low < self.count {
            let from = self.low.max(0.0).ceil() as usize;
            let to = (self.high.min(self.count - 1.0).floor() + 1.0).max(0.0) as usize;
            self.low += self.turn;
            self.high += self.turn;
            let groups = (from / GROUP).max(self.done)..to.div_ceil(GROUP);
            if from < to && !groups.is_empty() {
                self.done = groups.end;
                return Some(groups);
            }
        }
        None
    }
}

/// The beams of a line that look from one period of the row, and from where.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// Where beam 0 would start, with Y counted so that `beams` start within [0, period).
    pub(super) origin: [f64; 3],
    /// First beam, and the one after the last.
    pub(super) beams: (usize, usize),
    /// Least and greatest Y of those beams.
    pub(super) y_m: (f64, f64),
}

impl Part {
    /// Y of each of the eight beams of a row, counted from that of beam 0, and which of them are of this part.
    #[inline(always)]
    pub(super) fn beams_of<S: Simd>(
        &self,
        simd: S,
        advance_m: f64,
        row: usize,
        part: usize,
    ) -> (Lanes<S>, Mask<S>) {
        const PLACES: Row = Row([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let beam = PLACES.load(simd, part) + Lanes::splat(simd, (row * WIDTH) as f64);
        let own = beam.of(self.beams.0 as f64).le(beam).and(beam.lt(beam.of(self.beams.1 as f64)));
        (beam * beam.of(advance_m), own)
    }
}

/// Values in rows; the last row filled up with zeros.
pub(super) fn in_rows(values: &[f64]) -> Vec<Row> {
    let row = |chunk: &[f64]| {
        let mut row = Row::splat(0.0);
        row.0.iter_mut().zip(chunk).for_each(|(place, value)| *place = *value);
        row
    };
    values.chunks(WIDTH).map(row).collect()
}
