//! Directions about an axis.

use glam::DVec3;

use crate::angle::cos_sin_deg;

/// Rodrigues' rotation of `v` about the unit vector `k`: v cos a + (k × v) sin a + k (k·v)(1 − cos a).
pub(crate) fn rotate(v: DVec3, k: DVec3, angle_deg: f64) -> DVec3 {
    let (cos, sin) = cos_sin_deg(angle_deg);
    v * cos + k.cross(v) * sin + k * (k.dot(v) * (1.0 - cos))
}

/// A unit vector square to the unit vector `d`: d × the coordinate axis least aligned with it (the first of equals).
///
/// The paper takes an arbitrary second direction and does not say that the product must be normalised; it must.
pub(crate) fn square_to(d: DVec3) -> DVec3 {
    let size = d.abs();
    let least = if size.x <= size.y && size.x <= size.z {
        DVec3::X
    } else if size.y <= size.z {
        DVec3::Y
    } else {
        DVec3::Z
    };
    d.cross(least).normalize_or_zero()
}

/// The direction of an axis that leaves `d` at `angle_deg`, turned by `azimuth_deg` about `d` (paper eqs. 1 and 2).
pub(crate) fn fork(d: DVec3, angle_deg: f64, azimuth_deg: f64) -> DVec3 {
    let leaning = rotate(d, square_to(d), angle_deg);
    // Rounding would let directions grow over many generations.
    rotate(leaning, d, azimuth_deg).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_fork_keeps_its_angle_to_the_bearer(
            x in -1.0..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64, angle in 1.0..179.0f64, azimuth in 0.0..720.0f64,
        ) {
            let Some(d) = DVec3::new(x, y, z).try_normalize() else { return Ok(()) };
            let fork = fork(d, angle, azimuth);
            prop_assert!((fork.dot(d) - angle.to_radians().cos()).abs() < 1e-12);
            prop_assert!((fork.length() - 1.0).abs() < 1e-12);
            prop_assert!(square_to(d).dot(d).abs() < 1e-12);
        }
    }

    #[test]
    fn a_quarter_turn_about_z_takes_x_to_y() {
        assert!((rotate(DVec3::X, DVec3::Z, 90.0) - DVec3::Y).length() < 1e-15);
    }
}
