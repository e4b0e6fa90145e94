//! The files that users write, and the schema of each.

use rowscan_scenes::{Scene, files};
use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

use super::{defaults, ranges, tidy, units};

/// A kind of file that users write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Document {
    /// An orchard and the rig that drives past it
    Scene,
    /// A tractor with its scanners, for an estimate
    Rig,
    /// A run of the test bench: `rowscan check`
    Scenario,
    /// The boom of a sprayer in a scenario
    Boom,
    /// A study that sweeps keys of a scene: `rowscan study run`
    Study,
    /// A search for the values that come nearest: `rowscan study search`
    Search,
    /// Classes that calibrations are carried between: `rowscan study transfer`, `rowscan study coverage`
    Classes,
}

impl Document {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Scene, Self::Rig, Self::Scenario, Self::Boom, Self::Study, Self::Search, Self::Classes];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Rig => "rig",
            Self::Scenario => "scenario",
            Self::Boom => "boom",
            Self::Study => "study",
            Self::Search => "search",
            Self::Classes => "classes",
        }
    }

    /// What it is, in a sentence.
    pub fn about(self) -> &'static str {
        match self {
            Self::Scene => {
                "A scene: an orchard and the rig that drives past it. `rowscan emulate FILE` and every other command that takes SCENE read it."
            }
            Self::Rig => {
                "A rig: a tractor with its scanners, as an estimator believes them to be. `rowscan estimate SOURCE --rig FILE` reads it; so does a scene's table `[rig]`."
            }
            Self::Scenario => {
                "A scenario of the test bench: a scene, scanners, a controller and what is expected of it. `rowscan check FILE` runs it."
            }
            Self::Boom => {
                "A sprayer's boom: sections, nozzles, valves. A scenario's `sprayer` names it; docs/sprayer.md tells what it does."
            }
            Self::Study => "A study that varies keys of a scene. `rowscan study run FILE` runs it.",
            Self::Search => {
                "A search for the knobs that come nearest to a target. `rowscan study search FILE` runs it."
            }
            Self::Classes => {
                "Classes of orchards, scanners and tractors. `rowscan study transfer --classes FILE` carries calibrations between them, `rowscan study coverage --classes FILE` counts how often intervals hold the truth."
            }
        }
    }

    /// JSON Schema (draft 7) of the file, with units (`x-unit`), ranges in words (`x-allowed`) and reasons (`x-reason`).
    pub fn schema(self) -> Value {
        let settings = SchemaSettings::draft07().with(|settings| settings.inline_subschemas = true);
        let mut generator = settings.into_generator();
        let schema = match self {
            Self::Scene => generator.subschema_for::<Scene>(),
            Self::Rig => files::rig_schema(&mut generator),
            Self::Scenario => rowscan_check::scenario::schema(&mut generator),
            Self::Boom => generator.subschema_for::<rowscan_sprayer::Boom>(),
            Self::Study => rowscan_study::sweep::schema(&mut generator),
            Self::Search => rowscan_study::search::schema(&mut generator),
            Self::Classes => rowscan_study::classes::schema(&mut generator),
        };
        let mut schema = schema.to_value();
        tidy::tidy(&mut schema);
        units::add(&mut schema);
        if self == Self::Scene {
            defaults::fill(&mut schema);
        }
        if matches!(self, Self::Scene | Self::Rig) {
            ranges::ask(&mut schema);
        }
        if self == Self::Boom {
            ranges::ask_boom(&mut schema);
        }
        schema["$schema"] = json!("http://json-schema.org/draft-07/schema#");
        schema["title"] = json!(format!("rowscan {}", self.name()));
        schema["description"] = json!(self.about());
        schema
    }
}
