//! The stages of the device's eye, and which are on.

use rowscan_protocol::rig::BeamWidth;
use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

/// One thing that a real beam does and an ideal one does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The beam has a width.
    Spot,
    /// Returns close together are one echo.
    Echoes,
    /// Power by surface and distance, with a threshold.
    Energy,
    /// Weather, spray and dirt.
    Air,
    /// Ranges scatter.
    Noise,
}

/// A line of the stages' table.
#[derive(Clone, Copy, Debug)]
pub struct StageInfo {
    /// Which.
    pub stage: Stage,
    /// Its name in flags and scene files.
    pub name: &'static str,
    /// What it does.
    pub what: &'static str,
}

impl Stage {
    /// All stages, in the order in which light passes them.
    pub const TABLE: &[StageInfo] = &[
        StageInfo {
            stage: Self::Spot,
            name: "spot",
            what: "the beam's footprint: several scan planes and rays, weighted at each return's own range",
        },
        StageInfo {
            stage: Self::Echoes,
            name: "echoes",
            what: "returns closer than a pulse are one blended echo; as many echoes as the model tells apart",
        },
        StageInfo {
            stage: Self::Energy,
            name: "energy",
            what: "power by reflectance, incidence and distance; a soft threshold; remission as the model gives it",
        },
        StageInfo {
            stage: Self::Air,
            name: "air",
            what: "rain, snow, fog, dust, spray plumes and dirt on the window, as far as `[optics.air]` sets them",
        },
        StageInfo {
            stage: Self::Noise,
            name: "noise",
            what: "white noise, fixed pattern and systematic error of the unit",
        },
    ];
}

/// Which stages are on. In text: `ideal` (none), `device` (all), or names with commas between them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Stages(u8);

/// A name that is no stage.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "optics must be `ideal`, `device`, or stages with commas between them ({}), found `{found}`",
    names()
)]
pub struct StagesError {
    found: String,
}

fn names() -> String {
    let names: Vec<&str> = Stage::TABLE.iter().map(|line| line.name).collect();
    names.join(", ")
}

impl Stages {
    /// None: today's thin beam.
    pub const IDEAL: Self = Self(0);

    /// All of them.
    pub fn device() -> Self {
        Stage::TABLE.iter().fold(Self::IDEAL, |stages, line| stages.with(line.stage))
    }

    /// These and one more.
    #[must_use]
    pub const fn with(self, stage: Stage) -> Self {
        Self(self.0 | 1 << stage as u8)
    }

    /// True if the stage is on.
    pub const fn has(self, stage: Stage) -> bool {
        self.0 >> stage as u8 & 1 == 1
    }

    /// How wide the beams are with these on, as a rig says it.
    pub fn beam_width(self) -> BeamWidth {
        if self.has(Stage::Spot) { BeamWidth::Device } else { BeamWidth::Ideal }
    }

    /// True if none is on.
    pub const fn is_ideal(self) -> bool {
        self.0 == 0
    }
}

impl FromStr for Stages {
    type Err = StagesError;

    fn from_str(text: &str) -> Result<Self, StagesError> {
        match text.trim() {
            "ideal" => return Ok(Self::IDEAL),
            "device" => return Ok(Self::device()),
            _ => {}
        }
        let of = |name: &str| Stage::TABLE.iter().find(|line| line.name == name).map(|line| line.stage);
        text.split(',').map(str::trim).try_fold(Self::IDEAL, |stages, name| {
            of(name).map(|stage| stages.with(stage)).ok_or_else(|| StagesError { found: name.to_owned() })
        })
    }
}

impl TryFrom<String> for Stages {
    type Error = StagesError;

    fn try_from(text: String) -> Result<Self, StagesError> {
        text.parse()
    }
}

impl JsonSchema for Stages {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Stages".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "x-kind": format!("`ideal`, `device`, or stages with commas between them: {}", names()) })
    }
}

impl From<Stages> for String {
    fn from(stages: Stages) -> Self {
        stages.to_string()
    }
}

impl fmt::Display for Stages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_ideal() {
            return f.write_str("ideal");
        }
        if *self == Self::device() {
            return f.write_str("device");
        }
        let on = Stage::TABLE.iter().filter(|line| self.has(line.stage)).map(|line| line.name);
        f.write_str(&on.collect::<Vec<_>>().join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_stages_are_each_others_inverse_and_a_wrong_name_is_told() {
        for text in ["ideal", "device", "spot", "spot,noise"] {
            assert_eq!(text.parse::<Stages>().unwrap().to_string(), text);
        }
        assert_eq!("noise, spot".parse::<Stages>().unwrap().to_string(), "spot,noise");
        let message = "spot,nose".parse::<Stages>().unwrap_err().to_string();
        assert!(message.contains("found `nose`") && message.contains("echoes"), "{message}");
    }
}
