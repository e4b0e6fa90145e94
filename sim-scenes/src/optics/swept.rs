//! What a ray stands for, over the angle: a box with the ends that a second box makes by being swept over it.

use pulp::Simd;

use crate::lanes::{Lanes, Row};

/// The narrower box is at least this part of the wider one: what has no slant at all would need formulas of its own.
const LEAST_SLANT: f64 = 1e-9;

/// A trapezoid about angle 0, for each of a register of rays.
#[derive(Clone, Copy)]
pub(super) struct Swept<S: Simd> {
    /// Half of its foot, radians.
    pub(super) reach_rad: Lanes<S>,
    /// Half of its top, radians.
    pub(super) flat_rad: Lanes<S>,
    /// Its height: share a radian.
    pub(super) density: Lanes<S>,
    /// What its sides fall by, half a radian.
    pub(super) slope: Lanes<S>,
}

/// The same for eight rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct SweptRow {
    pub(super) reach_rad: Row,
    pub(super) flat_rad: Row,
    pub(super) density: Row,
    pub(super) slope: Row,
}

impl Default for SweptRow {
    fn default() -> Self {
        let none = Row::splat(0.0);
        Self { reach_rad: none, flat_rad: none, density: none, slope: none }
    }
}

impl SweptRow {
    /// Register `part`.
    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S, part: usize) -> Swept<S> {
        Swept {
            reach_rad: self.reach_rad.load(simd, part),
            flat_rad: self.flat_rad.load(simd, part),
            density: self.density.load(simd, part),
            slope: self.slope.load(simd, part),
        }
    }

    /// Writes register `part`.
    #[inline(always)]
    pub(super) fn store<S: Simd>(&mut self, part: usize, swept: Swept<S>) {
        self.reach_rad.store(part, swept.reach_rad);
        self.flat_rad.store(part, swept.flat_rad);
        self.density.store(part, swept.density);
        self.slope.store(part, swept.slope);
    }
}

impl<S: Simd> Swept<S> {
    /// `share` over ±`half_rad`, swept over ±`sweep_rad`. What has no width lies within one step of `step_rad`. And a quotient beside it, for one
    /// division gives both.
    #[inline(always)]
    pub(super) fn new(
        share: Lanes<S>,
        half_rad: Lanes<S>,
        sweep_rad: Lanes<S>,
        step_rad: f64,
        [above, below]: [Lanes<S>; 2],
    ) -> (Self, Lanes<S>) {
        let zero = share.of(0.0);
        let thin = half_rad.le(zero);
        let half = thin.select(share.of(step_rad / 4.0), half_rad);
        let sweep = thin.select(zero, sweep_rad);
        let wide = half.max(sweep);
        let narrow = half.min(sweep).max(wide * share.of(LEAST_SLANT));
        let area = share.of(8.0) * wide * narrow;
        let inverse = share.of(1.0) / (area * below);
        let slope = share * below * inverse;
        let swept = Self {
            reach_rad: wide + narrow,
            flat_rad: wide - narrow,
            density: share.of(4.0) * narrow * slope,
            slope,
        };
        (swept, above * area * inverse)
    }

    /// Share at angles from 0 to `angle`: all that lies beyond the reach is the same to the last bit.
    #[inline(always)]
    fn within(self, angle: f64) -> Lanes<S> {
        let angle = self.reach_rad.of(angle).min(self.reach_rad);
        let beyond = (angle - self.flat_rad).max(angle.of(0.0));
        angle * self.density - beyond * beyond * self.slope
    }

    /// The part of a beam's power that a ray stands for which lies `off` rays of `step_rad` beside its axis, on either side.
    #[inline(always)]
    pub(super) fn weight(self, off: usize, step_rad: f64) -> Lanes<S> {
        let half = self.within((off as f64 + 0.5) * step_rad);
        if off == 0 { half + half } else { half - self.within((off as f64 - 0.5) * step_rad) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share below an angle.
    fn below(angle: f64, half_rad: f64, sweep_rad: f64) -> f64 {
        let one = |value| Lanes::splat(pulp::Scalar::new(), value);
        let mut row = Row::splat(0.0);
        row.store(
            0,
            Swept::new(one(1.0), one(half_rad), one(sweep_rad), 1.0, [one(1.0); 2]).0.within(angle.abs()),
        );
        0.5 + row.0[0].copysign(angle)
    }

    #[test]
    fn a_swept_box_is_as_wide_as_spot_and_box_and_has_its_variance() {
        let (half, sweep) = (4.3e-3, 2.9e-3);
        assert!(
            below(-half - sweep, half, sweep) <= 1e-15 && below(half + sweep, half, sweep) >= 1.0 - 1e-15
        );
        let n = 4000;
        let width = half + sweep;
        let variance: f64 = (0..n)
            .map(|i| {
                let (from, to) = (f64::from(i), f64::from(i + 1));
                let at = |i: f64| width * (2.0 * i / f64::from(n) - 1.0);
                (below(at(to), half, sweep) - below(at(from), half, sweep)) * at((from + to) / 2.0).powi(2)
            })
            .sum();
        let expected = (half * half + sweep * sweep) / 3.0;
        assert!((variance / expected - 1.0).abs() < 1e-5, "{variance} {expected}");
    }

    #[test]
    fn a_box_without_slant_is_a_box_and_one_without_width_is_one_rays() {
        for (angle, expected) in [(-0.5, 0.0), (-0.1, 0.375), (0.0, 0.5), (0.2, 0.75), (0.4, 1.0)] {
            assert!((below(angle, 0.4, 0.0) - expected).abs() < 1e-8, "{angle}");
        }
        let one = |value| Lanes::splat(pulp::Scalar::new(), value);
        let (thin, _) = Swept::new(one(1.0), one(0.0), one(0.0), 0.01, [one(1.0); 2]);
        let weight = |off| {
            let mut row = Row::splat(0.0);
            row.store(0, thin.weight(off, 0.01));
            row.0[0]
        };
        assert!((weight(0) - 1.0).abs() < 1e-15 && weight(1) == 0.0);
    }
}
