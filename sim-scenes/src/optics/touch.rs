//! What part of a beam met, and the echoes made of it.

/// What part of a beam met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Touch {
    pub(super) range_m: f64,
    /// Share of the beam's power that went there.
    pub(super) share: f64,
    /// Power that came back, relative to a white wall at 1 m.
    pub(super) power: f64,
    /// Number of the ray that met it, or [`NO_RAY`].
    pub(super) ray: u32,
}

/// Ray number of a return that no surface gave.
pub(super) const NO_RAY: u32 = u32::MAX;

/// One echo of a beam, before it is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Echo {
    /// As its returns blend.
    pub(super) range_m: f64,
    pub(super) power: f64,
    /// Share of the beam that went there.
    pub(super) share: f64,
    /// Two standard deviations of the ranges in it.
    pub(super) spread_m: f64,
    /// The ray that returned most.
    pub(super) ray: u32,
}

impl Echo {
    /// Two standard deviations of ranges whose first and second moments, weighted by power, are these sums.
    pub(super) fn spread_m(power: f64, first: f64, second: f64) -> f64 {
        let mean_m = first / power;
        2.0 * (second / power - mean_m * mean_m).max(0.0).sqrt()
    }
}
