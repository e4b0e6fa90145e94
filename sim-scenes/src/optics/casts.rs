//! The scans of the paper through a device's eye.

use rowscan_protocol::optics::FactoryEcho;
use rowscan_protocol::random::mix;
use rowscan_protocol::rig::EchoChoice;
use rowscan_protocol::scan::Pose;

use super::eye::{Eye, EyeEcho, EyeModel};
use super::settings::OpticsSettings;
use super::stage::Stage;
use crate::caster::{BeamFan, Beams, Caster, Layers, Return, Scratch};
use crate::scan::Casts;

/// Casts fans through an eye: what a beam met are its echoes, at the ranges that the device reports, each with the surface that returned most
/// of it. A line's random numbers are keyed by its origin.
#[derive(Debug)]
pub struct EyeCaster {
    caster: Caster,
    eye: Eye,
    /// Returns are told apart as echoes.
    has_echoes: bool,
    last_only: bool,
}

impl EyeCaster {
    /// For lines with these beams, of a scanner that has its row at greater X, or at smaller.
    pub fn new(
        caster: Caster,
        model: EyeModel<'_>,
        settings: &OpticsSettings,
        seed: u64,
        fan: &BeamFan,
        towards_x: bool,
    ) -> Self {
        let mut eye = Eye::new(model, settings, seed, 0);
        eye.turn_to(fan, towards_x);
        let has_echoes = settings.stages.has(Stage::Echoes);
        let last_only = has_echoes && model.optics.factory_echo == FactoryEcho::Last;
        Self { caster, eye, has_echoes, last_only }
    }

    /// The same scanner, asked for this echo; `None` leaves it what it sends by itself.
    #[must_use]
    pub fn asked_for(self, echo: Option<EchoChoice>) -> Self {
        let last_only = match echo {
            None => self.last_only,
            Some(EchoChoice::First) => false,
            Some(EchoChoice::Last) => self.has_echoes,
        };
        Self { last_only, ..self }
    }
}

impl Casts for EyeCaster {
    fn cast_layers(&self, origin: Pose, beams: &Beams, k: usize, _: &mut Scratch, out: &mut Layers) {
        out.reset(beams.len(), k);
        // A clone a line, so that lines may be cast by any thread.
        let mut eye = self.eye.clone();
        let Pose { x_m, y_m, z_m } = origin;
        let key = [x_m, y_m, z_m].iter().fold(0, |key, place| mix(key ^ place.to_bits()));
        eye.look(&self.caster, origin, 0.0, key);
        for beam in 0..beams.len() {
            let echoes = eye.beam(beam);
            let seen = echoes.iter().rposition(|echo| echo.range_mm > 0).map_or(0, |last| last + 1);
            let from = if self.last_only { seen.saturating_sub(1) } else { 0 };
            out.set(beam, echoes.get(from..seen).unwrap_or(&[]).iter().map(reported));
        }
    }
}

/// What met the beam, where the device says it was.
fn reported(echo: &EyeEcho) -> Return {
    Return { range_m: f64::from(echo.range_mm) * 1e-3, ..echo.met }
}
