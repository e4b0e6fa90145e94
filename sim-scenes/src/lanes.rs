//! Eight numbers side by side, in whatever registers the machine has.
//!
//! Kernels are written once over [`pulp::Simd`], with plain IEEE operations and no fused multiply-add. So the widest registers and
//! one number at a time give the same bits, and which of them runs is found out at run time ([`pulp::Arch`]).
//!
//! Whatever touches a register must be inlined into the function that pulp compiles for it, or it falls back to calls through
//! memory. Closures and `array::map` cannot be told to: kernels use neither on [`Lanes`].

use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::Simd;

/// Numbers in a row; every register width divides it.
pub(crate) const WIDTH: usize = 8;

/// A list of one value a beam, and [`WIDTH`] behind it: a register may be read from any beam on. What is infinite meets nothing that
/// counts.
pub(crate) fn padded(mut values: Vec<f64>) -> Vec<f64> {
    values.resize(values.len() + WIDTH, f64::INFINITY);
    values
}

/// One row.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Row(pub(crate) [f64; WIDTH]);

impl Row {
    /// The same number in every place.
    pub(crate) const fn splat(value: f64) -> Self {
        Self([value; WIDTH])
    }

    /// Number of registers a row takes.
    #[inline(always)]
    pub(crate) const fn parts<S: Simd>() -> usize {
        WIDTH / S::F64_LANES
    }

    /// Register `part` of the row.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S, part: usize) -> Lanes<S> {
        Lanes { simd, value: S::as_simd_f64s(&self.0).0[part] }
    }

    /// The number of place `lane`, in every place.
    #[inline(always)]
    pub(crate) fn everywhere<S: Simd>(&self, simd: S, lane: usize) -> Lanes<S> {
        Lanes::splat(simd, self.0[lane])
    }

    /// Writes register `part` of the row.
    #[inline(always)]
    pub(crate) fn store<S: Simd>(&mut self, part: usize, lanes: Lanes<S>) {
        S::as_mut_simd_f64s(&mut self.0).0[part] = lanes.value;
    }
}

/// One register of numbers.
#[derive(Clone, Copy)]
pub(crate) struct Lanes<S: Simd> {
    simd: S,
    value: S::f64s,
}

/// One register of truths.
#[derive(Clone, Copy)]
pub(crate) struct Mask<S: Simd> {
    simd: S,
    value: S::m64s,
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        Self { simd, value: simd.splat_f64s(value) }
    }

    /// The same number in every place of a register like this one.
    #[inline(always)]
    pub(crate) fn of(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    /// `first` and the whole numbers after it.
    #[inline(always)]
    pub(crate) fn count_from(simd: S, first: usize) -> Self {
        const PLACES: Row = Row([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        PLACES.load(simd, 0) + Self::splat(simd, first as f64)
    }

    /// A register full from `from` on; None where `values` ends before.
    #[inline(always)]
    pub(crate) fn read(simd: S, values: &[f64], from: usize) -> Option<Self> {
        let values = values.get(from..from.checked_add(S::F64_LANES)?)?;
        let value = *S::as_simd_f64s(values).0.first()?;
        Some(Self { simd, value })
    }

    /// Writes the register to `values`, from `from` on; nowhere where they end before.
    #[inline(always)]
    pub(crate) fn write(self, values: &mut [f64], from: usize) {
        let Some(values) = from.checked_add(S::F64_LANES).and_then(|to| values.get_mut(from..to)) else {
            return;
        };
        if let [place, ..] = S::as_mut_simd_f64s(values).0 {
            *place = self.value;
        }
    }

    /// To the nearest whole number, for what is much less than 2⁵¹ either way.
    #[inline(always)]
    pub(crate) fn round(self) -> Self {
        const UNITS: f64 = 1.5 * (1u64 << 52) as f64;
        (self + self.of(UNITS)) - self.of(UNITS)
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        self.max(-self)
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self { value: self.simd.sqrt_f64s(self.value), ..self }
    }

    #[inline(always)]
    pub(crate) fn min(self, other: Self) -> Self {
        other.lt(self).select(other, self)
    }

    #[inline(always)]
    pub(crate) fn max(self, other: Self) -> Self {
        self.lt(other).select(other, self)
    }

    /// The least of all places.
    #[inline(always)]
    pub(crate) fn least(self) -> f64 {
        self.simd.reduce_min_f64s(self.value)
    }

    /// The most of all places.
    #[inline(always)]
    pub(crate) fn most(self) -> f64 {
        self.simd.reduce_max_f64s(self.value)
    }

    #[inline(always)]
    pub(crate) fn lt(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, value: self.simd.less_than_f64s(self.value, other.value) }
    }

    #[inline(always)]
    pub(crate) fn le(self, other: Self) -> Mask<S> {
        Mask { simd: self.simd, value: self.simd.less_than_or_equal_f64s(self.value, other.value) }
    }

    /// atan2(self, x), wrong by [`ATAN2_ERROR`] at most; NaN at the origin. By Abramowitz and Stegun 4.4.47.
    #[inline(always)]
    pub(crate) fn atan2(self, x: Self) -> Self {
        let (across, along) = (self.abs(), x.abs());
        let steep = along.lt(across);
        let ratio = across.min(along) / across.max(along);
        let square = ratio * ratio;
        // Halves side by side wait less for each other than one after the other.
        let low = self.of(0.999_866_0) + square * self.of(-0.330_299_5);
        let high = self.of(0.180_141_0) + square * self.of(-0.085_133_0);
        let fourth = square * square;
        let angle = ratio * (low + fourth * (high + fourth * self.of(0.020_835_1)));
        let angle = steep.select(self.of(std::f64::consts::FRAC_PI_2) - angle, angle);
        let angle = x.lt(self.of(0.0)).select(self.of(std::f64::consts::PI) - angle, angle);
        self.lt(self.of(0.0)).select(-angle, angle)
    }
}

/// Bound on the error of [`Lanes::atan2`], radians.
pub(crate) const ATAN2_ERROR: f64 = 1.2e-5;

impl<S: Simd> Mask<S> {
    #[inline(always)]
    pub(crate) fn select(self, yes: Lanes<S>, no: Lanes<S>) -> Lanes<S> {
        Lanes { simd: self.simd, value: self.simd.select_f64s(self.value, yes.value, no.value) }
    }

    #[inline(always)]
    pub(crate) fn and(self, other: Self) -> Self {
        Self { value: self.simd.and_m64s(self.value, other.value), ..self }
    }

    /// True if no place is.
    #[inline(always)]
    pub(crate) fn is_empty(self) -> bool {
        self.simd.first_true_m64s(self.value) >= S::F64_LANES
    }

    /// True where just one of both is.
    #[inline(always)]
    pub(crate) fn xor(self, other: Self) -> Self {
        Self { value: self.simd.xor_m64s(self.value, other.value), ..self }
    }

    #[inline(always)]
    pub(crate) fn or(self, other: Self) -> Self {
        Self { value: self.simd.or_m64s(self.value, other.value), ..self }
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $method:ident) => {
        impl<S: Simd> $trait for Lanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self { value: self.simd.$method(self.value, other.value), ..self }
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        // Exact, zeros included; pulp's own is a call on some widths.
        self.of(-0.0) - self
    }
}

#[cfg(test)]
mod tests {
    use pulp::{Arch, WithSimd};

    use super::*;

    struct Angles(Vec<(f64, f64)>);

    impl WithSimd for Angles {
        type Output = Vec<f64>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
            let angle = |&(y, x): &(f64, f64)| {
                let mut out = Row::splat(0.0);
                for part in 0..Row::parts::<S>() {
                    out.store(part, Lanes::splat(simd, y).atan2(Lanes::splat(simd, x)));
                }
                assert!(out.0.iter().all(|value| *value == out.0[0]));
                out.0[0]
            };
            self.0.iter().map(angle).collect()
        }
    }

    #[test]
    fn the_arctangent_keeps_its_bound_and_its_bits_on_any_register_width() {
        let points: Vec<(f64, f64)> = (0..200_000)
            .map(|k| {
                let angle = std::f64::consts::PI * f64::from(k - 100_000) / 100_000.0;
                (3.7 * angle.sin(), 3.7 * angle.cos())
            })
            .collect();
        let wide = Arch::new().dispatch(Angles(points.clone()));
        let single = Angles(points.clone()).with_simd(pulp::Scalar::new());
        for (((y, x), wide), single) in points.iter().zip(wide).zip(single) {
            assert!((wide - y.atan2(*x)).abs() < ATAN2_ERROR, "{y} {x}: {wide}");
            assert_eq!(wide.to_bits(), single.to_bits());
        }
    }
}
