//! Cosine and sine of angles in degrees.

use std::f64::consts::FRAC_PI_2;

/// (cos, sin) of an angle in degrees: the same bits on every machine, and exact at every multiple of 90°, so that a beam
/// straight at the horizon does not touch the ground.
pub(crate) fn cos_sin_deg(angle_deg: f64) -> (f64, f64) {
    let quarter = (angle_deg / 90.0).round();
    let rest = (angle_deg - 90.0 * quarter) / 90.0 * FRAC_PI_2;
    let (cos, sin) = (libm::cos(rest), libm::sin(rest));
    match quarter.rem_euclid(4.0) as u8 {
        0 => (cos, sin),
        1 => (-sin, cos),
        2 => (-cos, -sin),
        _ => (sin, -cos),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_are_exact_and_the_rest_is_right() {
        for (angle_deg, expected) in
            [(0.0, (1.0, 0.0)), (90.0, (0.0, 1.0)), (-180.0, (-1.0, 0.0)), (270.0, (0.0, -1.0))]
        {
            assert_eq!(cos_sin_deg(angle_deg), expected, "{angle_deg}");
            assert_eq!(cos_sin_deg(angle_deg - 720.0), expected, "{angle_deg}");
        }
        for k in -1000..1000 {
            let angle_deg = f64::from(k) * 0.77;
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            let found = cos_sin_deg(angle_deg);
            assert!((found.0 - cos).abs() < 1e-14 && (found.1 - sin).abs() < 1e-14, "{angle_deg}");
        }
    }
}
