//! From depth keys to ranges.

use std::marker::PhantomData;

use pulp::{Simd, WithSimd};

use super::nearest::Nearest;
use super::sight::Sight;
use crate::lanes::Lanes;

/// Turns the depth keys of a line into ranges: after this pass nothing more is entered.
pub(super) struct RangePass<'a, T>(&'a mut Nearest, PhantomData<T>);

impl<'a, T: Sight> RangePass<'a, T> {
    pub(super) fn of(nearest: &'a mut Nearest) -> Self {
        Self(nearest, PhantomData)
    }
}

impl<T: Sight> WithSimd for RangePass<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let keys = self.0.keys_mut();
        for from in (0..keys.len()).step_by(S::F64_LANES) {
            // The last beams of all, where they do not fill a register, are those that a line is padded with.
            let Some(key) = Lanes::read(simd, keys, from) else { break };
            T::key(simd, key).write(keys, from);
        }
    }
}
