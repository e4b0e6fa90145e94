//! Rectangles of the scan plane.

/// A rectangle of the scan plane, metres from the line's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rectangle {
    /// Least X and Z.
    pub(super) low: [f64; 2],
    /// Greatest X and Z.
    pub(super) high: [f64; 2],
}

impl Rectangle {
    pub(super) const NOTHING: Self = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };

    /// What a ball takes up across the row.
    pub(super) fn around([x_m, _, z_m]: [f64; 3], radius_m: f64) -> Self {
        Self { low: [x_m - radius_m, z_m - radius_m], high: [x_m + radius_m, z_m + radius_m] }
    }

    /// How far its nearest point is; 0 from within.
    pub(super) fn distance_m(&self) -> f64 {
        let along = |axis: usize| self.low[axis].max(-self.high[axis]).max(0.0);
        along(0).hypot(along(1))
    }

    pub(super) fn and(self, other: Self) -> Self {
        let pick = |of: fn(f64, f64) -> f64, a: [f64; 2], b: [f64; 2]| [of(a[0], b[0]), of(a[1], b[1])];
        Self { low: pick(f64::min, self.low, other.low), high: pick(f64::max, self.high, other.high) }
    }
}
