//! Parallel beams: the orthogonal scans of the paper.

use glam::DVec3;
use pulp::Simd;

use super::sight::{Cut, Points, Rays, Segments, Sight};
use crate::lanes::{Lanes, padded};

/// Evenly spaced parallel beams. Beam `j` starts `offset_m + j · step_m` from the line's origin, along +Z or +X.
#[derive(Clone, Debug, PartialEq)]
pub struct ParallelBeams {
    view: View,
    step_m: f64,
    count: usize,
    /// Of every beam, padded, as are as many ones.
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
        let offsets: Vec<f64> = (0..count).map(|j| offset_m + j as f64 * step_m).collect();
        Self { view, step_m, count, offsets: padded(offsets), ones: padded(vec![1.0; count]) }
    }

    /// Number of beams.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if there is no beam.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Where beam `j` starts from the line's origin, metres along +Z or +X; NaN where there is no such beam.
    pub fn offset_m(&self, j: usize) -> f64 {
        self.offsets.get(j).filter(|_| j < self.count).copied().unwrap_or(f64::NAN)
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

    /// Start of beam `j`.
    pub(super) fn start(&self, [x, y, z]: [f64; 3], j: usize) -> [f64; 3] {
        let (offset, (along_x, along_z)) = (self.offset_m(j), self.across());
        [x + offset * along_x, y, z + offset * along_z]
    }
}

/// How far (in beams) an interval is widened: far above rounding.
const MARGIN: f64 = 1e-6;

impl ParallelBeams {
    /// Offsets from `low` to `high` (metres) as beam numbers, widened.
    #[inline(always)]
    fn interval<S: Simd>(&self, low: Lanes<S>, high: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
        let (first, step, margin) = (low.of(self.offset_m(0)), low.of(self.step_m), low.of(MARGIN));
        let (one, other) = ((low - first) / step, (high - first) / step);
        (one.min(other) - margin, one.max(other) + margin)
    }
}

impl Sight for ParallelBeams {
    const FARTHEST: f64 = f64::NEG_INFINITY;
    const ONE_START: bool = false;

    fn count(&self) -> usize {
        self.len()
    }

    fn parameters(&self) -> (&[f64], &[f64]) {
        (&self.ones, &self.offsets)
    }

    #[inline(always)]
    fn segments<S: Simd>(&self, _: S, part: usize, cut: Cut<S>, out: &mut Segments) {
        let Cut { a, b, normal, distance, cut } = cut;
        let (ahead, across) = (self.direction(), self.across());
        let zero = distance.of(0.0);
        let facing = normal.onto(ahead);
        let (range_a, range_b) = (a.onto(ahead), b.onto(ahead));
        let met = cut.and(zero.lt(facing.abs())).and(zero.lt(range_a.max(range_b)));
        let (at_a, at_b) = (a.onto(across), b.onto(across));
        // What lies behind the starts is cut off.
        let start = at_a + (at_b - at_a) * (range_a / (range_a - range_b));
        let at_a = range_a.le(zero).select(start, at_a);
        let at_b = range_b.le(zero).select(start, at_b);
        let (from, to) = (at_a.min(at_b), at_a.max(at_b));
        let (low, high) = self.interval(from, to);
        out.key[0].store(part, -distance / facing);
        out.key[1].store(part, normal.onto(across) / facing);
        out.from[0].store(part, -from);
        out.from[1].store(part, zero.of(1.0));
        out.to[0].store(part, to);
        out.to[1].store(part, zero.of(-1.0));
        out.spans.set(part, met.select(low, zero.of(f64::INFINITY)), high);
    }

    #[inline(always)]
    fn meeting<S: Simd>(&self, middle: Points<S>, radius: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
        let middle = middle.onto(self.across());
        self.interval(middle - radius, middle + radius)
    }

    fn turn(&self) -> f64 {
        f64::INFINITY
    }

    fn advance_m(&self) -> f64 {
        0.0
    }

    #[inline(always)]
    fn rays<S: Simd>(&self, simd: S, _p: Lanes<S>, q: Lanes<S>) -> Rays<S> {
        let ((across_x, across_z), (x, z)) = (self.across(), self.direction());
        Rays {
            start: Points(q * q.of(across_x), q * q.of(across_z)),
            direction: Points(Lanes::splat(simd, x), Lanes::splat(simd, z)),
        }
    }

    #[inline(always)]
    fn key<S: Simd>(_: S, range_m: Lanes<S>) -> Lanes<S> {
        -range_m
    }

    #[inline(always)]
    fn direction(&self, _: usize) -> (f64, f64) {
        self.direction()
    }

    #[inline(always)]
    fn ray(&self, j: usize) -> (DVec3, DVec3) {
        let (x, z) = self.direction();
        (DVec3::from_array(self.start([0.0; 3], j)), DVec3::new(x, 0.0, z))
    }
}
