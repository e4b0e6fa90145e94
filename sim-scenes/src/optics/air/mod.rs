//! What is in the air and on the window: it dims the beam, and answers itself.
//!
//! Every part adds returns to those of surfaces, before echoes are formed, and takes power from what lies behind it. Parts that are not
//! set do nothing. Formulas and sources: docs/optics.md.

mod drops;
mod haze;
mod plume;
mod settings;
mod shot;
mod sun;
mod window;

pub use haze::{BACKSCATTER_SR, DUST_BACKSCATTER_SR};
pub use plume::{FlowChange, Moment, Plume, Source};
pub use settings::Air;
use sun::Glare;
pub use sun::Sun;
pub(super) use sun::{DAZZLED_SHARE, POWER_FACTOR};
pub use window::WindowSector;

use rowscan_protocol::optics::Optics;
use rowscan_protocol::rig::Axes;

use super::draws::Use;
use super::parts::Parts;
use super::touch::Touch;
use drops::Drops;
use haze::Haze;
pub(super) use shot::Shot;

/// The air before one scanner.
#[derive(Clone, Debug)]
pub(super) struct AirStage {
    air: Air,
    drops: Vec<Drops>,
    haze: Haze,
    /// The plumes with the flows of now.
    spraying: Vec<Plume>,
    glare: Option<Glare>,
}

impl AirStage {
    pub(super) fn new(air: &Air, optics: &Optics) -> Self {
        let reflectance = if air.drop_reflectance > 0.0 { air.drop_reflectance } else { drops::WATER };
        let rain = (air.rain_mm_h > 0.0).then(|| Drops::rain(optics, air.rain_mm_h, reflectance));
        let snow = (air.snow_mm_h > 0.0).then(|| Drops::snow(optics, air.snow_mm_h));
        let haze =
            Haze::new(optics, air.visibility_m, air.dust_g_m3, drops::extinction_of_rain(air.rain_mm_h));
        let mut stage = Self {
            air: air.clone(),
            spraying: air.plumes.clone(),
            glare: air.sun.map(|sun| Glare::new(sun, &optics.spot)),
            drops: rain.into_iter().chain(snow).collect(),
            haze,
        };
        stage.spray(Moment::default(), &|_| None);
        stage
    }

    /// Nozzles spray from now on as they do at this moment of the drive; `duty` is what each one's source says.
    pub(super) fn spray(&mut self, drive: Moment, duty: &dyn Fn(Source) -> Option<f64>) {
        for (number, (now, plume)) in self.spraying.iter_mut().zip(&self.air.plumes).enumerate() {
            now.flow_l_min = plume.flow_at(drive, duty(plume.source(number)));
        }
    }

    /// True if it leaves all beams as they are.
    pub(super) fn is_clear(&self) -> bool {
        let Air { windows, window_drops, .. } = &self.air;
        self.drops.is_empty()
            && self.haze.is_clear()
            && self.spraying.iter().all(|plume| plume.flow_l_min <= 0.0)
            && windows.is_empty()
            && *window_drops <= 0.0
    }

    /// Dims what the parts of beam `lane` met, and adds what the air returns.
    pub(super) fn act(&self, shot: Shot, parts: &mut Parts, lane: usize) {
        let clear_m = parts.nearest_m().0.get(lane).copied().unwrap_or(f64::INFINITY);
        let free_m = clear_m.min(drops::FARTHEST_M);
        let extinction = self.haze.extinction(shot);
        let (mut left, mut own) = (1.0, Vec::new());
        for plume in &self.spraying {
            left *= plume.act(shot, free_m, &mut own);
        }
        own.extend(self.haze.echo(shot, extinction, free_m));
        for (kind, drops) in self.drops.iter().enumerate() {
            drops.act(shot.draws(Use::Drops).echo(kind), free_m, &mut own);
        }
        let window = self.window(shot);
        parts.dim(lane, |range_m| window * left * libm::exp(-2.0 * extinction * range_m));
        for touch in own {
            parts.add(lane, Touch { power: touch.power * window, ..touch });
        }
    }

    /// True if a beam looks into the sun: at `theta_rad` from the scene's +X, in a plane turned so.
    pub(super) fn is_blinded(&self, theta_rad: f64, layer_rad: f64, plane: Option<&Axes>) -> bool {
        self.glare.is_some_and(|glare| glare.blinds(theta_rad, layer_rad, plane))
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
