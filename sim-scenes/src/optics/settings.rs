//! The table `[optics]` of a scene.

use rowscan_protocol::rig::BeamWidth;
use rowscan_vehicle::ParameterError;
use rowscan_vehicle::parameter::{require, require_within};
use serde::{Deserialize, Serialize};

use super::air::Air;
use super::energy::Reflectance;
use super::stage::{Stage, Stages};

/// How the scene's scanners see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OpticsSettings {
    /// Which stages are on.
    pub stages: Stages,
    /// How finely the spot is sampled: 1 is 3 planes of 5 rays, 2 is 5 × 9, 3 is 7 × 9, 4 is 9 × 15.
    pub quality: u8,
    /// The distance at which the spot has that many planes and rays, metres: the middle of the canopy. Nearer and farther spots share them.
    pub reference_range_m: f64,
    /// What the range of an echo is whose returns are closer than a pulse. Needs the stage `echoes`.
    pub blend: Blend,
    /// How wide a pulse is at half its height, metres of range, where `blend` is `pulse`: 5 ns are 0.75 m.
    pub pulse_m: f64,
    /// Share of the spot that an echo must have, 0 to 1, besides the least power that is detected. 0 is what is known of factory settings.
    pub min_share: f64,
    /// The unit's seed: its fixed pattern, systematic error and bend. Left out, the scene's seed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 5)]
    pub unit: Option<u64>,
    /// Bends the scan plane to a cone where the model's is: by an angle of the unit's own. Needs the stage `spot`.
    pub bent_plane: bool,
    /// How much ranges scatter.
    pub noise: NoiseLevel,
    /// How wet surfaces are, 0 to 1: a wet one returns 0.7 times as much.
    pub wetness: f64,
    /// Reflectance by class.
    pub reflectance: Reflectance,
    /// Weather, spray and dirt; clear where left out.
    pub air: Air,
}

/// What the range of an echo is whose returns are closer than a pulse. No maker tells it: three rules, of which recordings of edges exclude none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Blend {
    /// The mean by power of the returns within 1 m
    #[default]
    Mean,
    /// The peak of the sum of Gaussian pulses
    Pulse,
    /// The nearest return within 1 m: a receiver that times the first rise
    Nearest,
}

/// How much ranges scatter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum NoiseLevel {
    /// As recorded below 3 m.
    #[default]
    Recorded,
    /// As the data sheet has it.
    Sheet,
}

impl Default for OpticsSettings {
    fn default() -> Self {
        Self {
            stages: Stages::IDEAL,
            quality: 2,
            reference_range_m: 2.5,
            blend: Blend::Mean,
            pulse_m: 0.75,
            min_share: 0.0,
            unit: None,
            bent_plane: false,
            noise: NoiseLevel::Recorded,
            wetness: 0.0,
            reflectance: Reflectance::default(),
            air: Air::default(),
        }
    }
}

impl OpticsSettings {
    /// Refuses values that no eye has.
    ///
    /// # Errors
    /// The first key with an invalid value.
    pub fn validate(&self) -> Result<(), ParameterError> {
        require((1..=4).contains(&self.quality), "optics.quality", "from 1 to 4", self.quality)?;
        require_within("optics.reference_range_m", self.reference_range_m, 0.1, 50.0)?;
        require_within("optics.pulse_m", self.pulse_m, 0.05, 5.0)?;
        require_within("optics.min_share", self.min_share, 0.0, 1.0)?;
        require_within("optics.wetness", self.wetness, 0.0, 1.0)?;
        self.reflectance.validate()?;
        self.air.validate()
    }

    /// Whether weather, spray or dirt is set that has no effect.
    pub fn air_is_off(&self) -> bool {
        self.air != Air::default() && !self.stages.has(Stage::Air)
    }

    /// The contamination that scanners report, as LCMstate has it: 0 to 3.
    pub fn contamination(&self) -> u8 {
        if self.stages.has(Stage::Air) { self.air.contamination() } else { 0 }
    }

    /// The seed of the unit that scanner number `scanner` is, in a scene with this seed.
    pub fn unit_of(&self, seed: u64, scanner: usize) -> u64 {
        self.unit.unwrap_or(seed) ^ (scanner as u64).rotate_left(32)
    }

    /// How wide the beams are, as a rig says it.
    pub fn beam_width(&self) -> BeamWidth {
        self.stages.beam_width()
    }

    /// Planes, and rays in a plane.
    pub(super) fn grid(&self) -> (usize, usize) {
        match self.quality {
            0 | 1 => (3, 5),
            2 => (5, 9),
            3 => (7, 9),
            _ => (9, 15),
        }
    }
}
