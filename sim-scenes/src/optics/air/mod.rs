//! What is in the air and on the window: it dims the beam, and answers itself.
//!
//! Every part adds returns to those of surfaces, before echoes are formed, and takes power from what lies behind it. Parts that are not
//! set do nothing. Formulas and sources: docs/optics.md.

mod drops;
mod haze;
mod plume;
mod window;

pub use haze::{BACKSCATTER_SR, DUST_BACKSCATTER_SR};
pub use plume::Plume;
pub use window::WindowSector;

use rowscan_protocol::optics::Optics;
use rowscan_vehicle::ParameterError;
use rowscan_vehicle::parameter::require_within;
use serde::{Deserialize, Serialize};

use super::draws::{Draws, Use};
use super::footprint::Touch;
use drops::Drops;
use haze::Haze;

/// Ray number of a return that no surface gave.
pub(super) const NO_RAY: u32 = u32::MAX;

/// Longest layer that one pulse gathers light from, metres: half of 5 ns \[ASM\].
const PULSE_M: f64 = 0.75;

/// Weather, spray and dirt: table `[optics.air]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Air {
    /// Rain, mm/h.
    pub rain_mm_h: f64,
    /// Snow, mm/h of water.
    pub snow_mm_h: f64,
    /// Reflectance of rain drops; 0 stands for 0.02, what water returns; 0.33 is an upper bound.
    pub drop_reflectance: f64,
    /// Visibility in fog, metres; without it the air is clear.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visibility_m: Option<f64>,
    /// Dust, g/m³, in gusts.
    pub dust_g_m3: f64,
    /// Share of shots, 0 to 1, that a drop on the window takes 5 to 30 % of.
    pub window_drops: f64,
    /// Spraying nozzles.
    #[serde(rename = "plume", skip_serializing_if = "Vec::is_empty")]
    pub plumes: Vec<Plume>,
    /// Dirt on the window.
    #[serde(rename = "window", skip_serializing_if = "Vec::is_empty")]
    pub windows: Vec<WindowSector>,
}

impl Air {
    /// # Errors
    /// The first key with an invalid value.
    pub(super) fn validate(&self) -> Result<(), ParameterError> {
        require_within("optics.air.rain_mm_h", self.rain_mm_h, 0.0, 500.0)?;
        require_within("optics.air.snow_mm_h", self.snow_mm_h, 0.0, 100.0)?;
        require_within("optics.air.drop_reflectance", self.drop_reflectance, 0.0, 1.0)?;
        require_within("optics.air.visibility_m", self.visibility_m.unwrap_or(1e3), 1.0, 1e6)?;
        require_within("optics.air.dust_g_m3", self.dust_g_m3, 0.0, 100.0)?;
        require_within("optics.air.window_drops", self.window_drops, 0.0, 1.0)?;
        self.plumes.iter().try_for_each(Plume::validate)?;
        self.windows.iter().try_for_each(WindowSector::validate)
    }
}

/// The air before one scanner.
#[derive(Clone, Debug)]
pub(super) struct AirStage {
    air: Air,
    drops: Vec<Drops>,
    haze: Haze,
}

/// The shot that air acts on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shot {
    pub(super) seed: u64,
    pub(super) scan: u64,
    pub(super) beam: usize,
    /// θ of the beam, radians.
    pub(super) theta_rad: f64,
}

impl Shot {
    fn draws(&self, purpose: Use) -> Draws {
        Draws::of(self.seed, purpose, self.scan).beam(self.beam)
    }
}

impl AirStage {
    pub(super) fn new(air: &Air, optics: &Optics) -> Self {
        let reflectance = if air.drop_reflectance > 0.0 { air.drop_reflectance } else { drops::WATER };
        let rain = (air.rain_mm_h > 0.0).then(|| Drops::rain(optics, air.rain_mm_h, reflectance));
        let snow = (air.snow_mm_h > 0.0).then(|| Drops::snow(optics, air.snow_mm_h));
        let haze = Haze::new(optics, air, drops::extinction_of_rain(air.rain_mm_h));
        Self { air: air.clone(), drops: rain.into_iter().chain(snow).collect(), haze }
    }

    /// Dims what a beam's parts met, and adds what the air returns.
    pub(super) fn act(&self, shot: Shot, touches: &mut Vec<Touch>) {
        let clear = touches.iter().map(|touch| touch.range_m).fold(f64::INFINITY, f64::min);
        let free_m = clear.min(drops::FARTHEST_M);
        let solid = touches.len();
        let extinction = self.haze.extinction(shot);
        for touch in touches.iter_mut() {
            touch.power *= libm::exp(-2.0 * extinction * touch.range_m);
        }
        for plume in &self.air.plumes {
            plume.act(shot, free_m, touches);
        }
        touches.extend(self.haze.echo(shot, extinction, free_m));
        for (kind, drops) in self.drops.iter().enumerate() {
            drops.act(shot.draws(Use::Drops).echo(kind), free_m, touches);
        }
        let window = self.window(shot);
        for (number, touch) in touches.iter_mut().enumerate() {
            touch.power *= window;
            if number >= solid {
                touch.ray = NO_RAY;
            }
        }
    }

    /// What the window leaves of the power, both ways.
    fn window(&self, shot: Shot) -> f64 {
        let mut left: f64 = self.air.windows.iter().map(|sector| sector.left(shot.theta_rad)).product();
        let mut draws = shot.draws(Use::WindowDrop);
        if draws.unit() < self.air.window_drops {
            let lost = 0.05 + 0.25 * draws.unit();
            left *= (1.0 - lost) * (1.0 - lost);
        }
        left
    }
}
