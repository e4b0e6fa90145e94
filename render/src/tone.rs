//! From light to what stands in the file: exposure, a film's curve, sRGB.

use glam::Vec3;

/// Light as a display shows it, linear, from 0 to 1: highlights are rolled off as film does (Narkowicz's fit of the ACES curve).
pub(crate) fn developed(light: Vec3, exposure: f32) -> Vec3 {
    let x = light * exposure;
    let curve = (x * (x * 2.51 + 0.03)) / (x * (x * 2.43 + 0.59) + 0.14);
    curve.clamp(Vec3::ZERO, Vec3::ONE)
}

/// The linear value of an sRGB byte.
pub(crate) fn linear(byte: u8) -> f32 {
    let value = f32::from(byte) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { libm::powf((value + 0.055) / 1.055, 2.4) }
}

/// The linear colour of three sRGB bytes.
pub(crate) fn linear_rgb(rgb: [u8; 3]) -> Vec3 {
    Vec3::from_array(rgb.map(linear))
}

/// The sRGB bytes of a linear colour from 0 to 1.
pub(crate) fn srgb(colour: Vec3) -> [u8; 3] {
    colour.to_array().map(|value| {
        let value = value.clamp(0.0, 1.0);
        let encoded =
            if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * libm::powf(value, 1.0 / 2.4) - 0.055 };
        (255.0 * encoded + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_comes_back() {
        for byte in 0..=255u8 {
            assert_eq!(srgb(linear_rgb([byte, 255 - byte, byte / 2])), [byte, 255 - byte, byte / 2]);
        }
    }

    #[test]
    fn more_light_is_never_darker() {
        let of = |light: f32| developed(Vec3::splat(light), 1.0).x;
        assert!((0..400).all(|k| of(k as f32 * 0.02) <= of((k + 1) as f32 * 0.02)));
        assert!(of(0.0) == 0.0 && of(50.0) == 1.0);
    }
}
