//! Directions about an axis, and small draws.

use glam::DVec3;

use crate::angle::cos_sin_deg;
use crate::growth::rotation::{rotate, square_to};
use crate::seed::Stream;

/// Bearing of one shoot, leaf or spur to the next about its axis (phyllotaxis 2/5).
pub(super) const DIVERGENCE_DEG: f64 = 144.0;

/// A direction square to `axis`, `azimuth_deg` about it.
pub(super) fn radial(axis: DVec3, azimuth_deg: f64) -> DVec3 {
    rotate(square_to(axis), axis, azimuth_deg)
}

/// A direction at `angle_deg` from `axis`, towards `radial`.
pub(super) fn leave(axis: DVec3, radial: DVec3, angle_deg: f64) -> DVec3 {
    let (cos, sin) = cos_sin_deg(angle_deg);
    (axis * cos + radial * sin).normalize_or_zero()
}

/// `direction` turned towards `aim` by a share of the way.
pub(super) fn towards(direction: DVec3, aim: DVec3, share: f64) -> DVec3 {
    (direction * (1.0 - share) + aim * share).try_normalize().unwrap_or(direction)
}

/// A draw from `mean · (1 ± spread)`, evenly.
pub(super) fn about(mean: f64, spread: f64, stream: &mut Stream) -> f64 {
    mean * (1.0 + spread * (2.0 * stream.unit() - 1.0))
}

/// A whole number with the given mean: its floor, or one more.
pub(super) fn count(mean: f64, stream: &mut Stream) -> u32 {
    (mean + stream.unit()).floor().clamp(0.0, 1e6) as u32
}

/// A direction within some degrees of another, evenly in angle.
pub(super) fn jitter(direction: DVec3, most_deg: f64, stream: &mut Stream) -> DVec3 {
    let radial = radial(direction, 360.0 * stream.unit());
    leave(direction, radial, most_deg * stream.unit())
}
