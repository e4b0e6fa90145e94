//! Fog and dust: they dim, and answer as one layer.

use rowscan_protocol::optics::Optics;

use super::shot::{PULSE_M, Shot};
use crate::optics::draws::Use;
use crate::optics::touch::{NO_RAY, Touch};

/// Extinction over backscatter of water droplets at 905 nm, sr \[S21\].
pub const BACKSCATTER_SR: f64 = 18.8;

/// The same of field dust, sr \[ASM\].
pub const DUST_BACKSCATTER_SR: f64 = 50.0;

/// Extinction of dust, m²/g \[ASM\].
const DUST_M2_G: f64 = 0.3;

/// Where a layer's echo stands: its power, seen through the near field, peaks here, metres \[ASM\].
const PEAK_M: (f64, f64) = (1.0, 1.5);

/// What hangs in the air evenly.
#[derive(Clone, Copy, Debug)]
pub(super) struct Haze {
    /// Extinction by fog and rain, 1/m.
    even: f64,
    /// Of these, fog.
    fog: f64,
    /// Mean extinction by dust, 1/m.
    dust: f64,
}

impl Haze {
    /// Fog by its visibility, dust by its mass in the air (g/m³), and what rain adds (1/m).
    pub(super) fn new(optics: &Optics, visibility_m: Option<f64>, dust_g_m3: f64, rain: f64) -> Self {
        let fog = visibility_m.map_or(0.0, |visibility| kruse(visibility, optics.wavelength_nm.value));
        Self { even: fog + rain, fog, dust: DUST_M2_G * dust_g_m3 }
    }

    /// True if there is none.
    pub(super) fn is_clear(&self) -> bool {
        self.even <= 0.0 && self.dust <= 0.0
    }

    /// Extinction along one shot, 1/m.
    pub(super) fn extinction(&self, shot: Shot) -> f64 {
        self.even + self.dust(shot)
    }

    /// Dust comes in gusts: lognormal from line to line, sd 1 of the logarithm, mean as set.
    fn dust(&self, shot: Shot) -> f64 {
        if self.dust <= 0.0 {
            return 0.0;
        }
        let gust = Shot { beam: 0, ..shot }.draws(Use::Gust).normal();
        self.dust * libm::exp(gust - 0.5)
    }

    /// The layer's own return before what stands at `free_m`.
    pub(super) fn echo(&self, shot: Shot, extinction: f64, free_m: f64) -> Option<Touch> {
        let backscatter = self.fog / BACKSCATTER_SR + self.dust(shot) / DUST_BACKSCATTER_SR;
        let (near_m, far_m) = PEAK_M;
        let range_m = near_m + (far_m - near_m) * shot.draws(Use::Layer).unit();
        if backscatter <= 0.0 || free_m <= range_m {
            return None;
        }
        let reflectance = std::f64::consts::PI * backscatter * PULSE_M.min(free_m);
        let power = reflectance * libm::exp(-2.0 * extinction * range_m) / (far_m * far_m);
        Some(Touch { range_m, share: 0.0, power, ray: NO_RAY })
    }
}

/// Extinction of fog by its visibility, 1/m (Kruse \[MEM\]).
fn kruse(visibility_m: f64, wavelength_nm: f64) -> f64 {
    let km = visibility_m * 1e-3;
    let slope = match km {
        km if km < 6.0 => 0.585 * libm::cbrt(km),
        km if km < 50.0 => 1.3,
        _ => 1.6,
    };
    3.91 / visibility_m * libm::pow(550.0 / wavelength_nm, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fog_dims_as_kruse_has_it_and_its_layer_has_the_reflectance_of_the_sheet() {
        for (visibility_m, extinction, reflectance) in [(50.0, 0.070, 0.0088), (200.0, 0.0165, 0.0021)] {
            let alpha = kruse(visibility_m, 905.0);
            assert!((alpha / extinction - 1.0).abs() < 0.03, "{alpha}");
            let layer = std::f64::consts::PI * alpha / BACKSCATTER_SR * PULSE_M;
            assert!((layer / reflectance - 1.0).abs() < 0.03, "{layer}");
        }
    }
}
