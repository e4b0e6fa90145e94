//! The sky, and the light that sun and sky give.

use glam::Vec3;

/// What a white surface square to the sun would shine with.
pub(crate) const SUN: Vec3 = Vec3::new(2.45, 2.20, 1.72);

/// What a white level surface would shine with under the sky alone.
pub(crate) const SKY: Vec3 = Vec3::new(0.36, 0.45, 0.62);

/// What the ground throws back at a surface that looks down.
pub(crate) const BOUNCE: Vec3 = Vec3::new(0.20, 0.19, 0.10);

/// Colours of the sky at the horizon and above.
const HORIZON: Vec3 = Vec3::new(0.60, 0.73, 0.90);
const ZENITH: Vec3 = Vec3::new(0.12, 0.28, 0.66);

/// The sky in a direction of unit length.
pub(crate) fn colour(towards: Vec3) -> Vec3 {
    let up = towards.z.clamp(0.0, 1.0);
    // Air thins fast above the horizon.
    HORIZON.lerp(ZENITH, 1.0 - libm::expf(-3.4 * up))
}

/// A colour seen through so many metres of air.
pub(crate) fn hazy(colour: Vec3, distance_m: f32) -> Vec3 {
    colour.lerp(HORIZON, 1.0 - libm::expf(-distance_m / 900.0))
}
