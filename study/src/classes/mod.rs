//! Classes of orchards, scanners and tractors, and a row of one of them driven past.

mod file;
mod reimport;

use rowscan_canopy::{Calibration, EstimatorInfo};
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Rig;
use rowscan_scenes::Scene;
use serde::{Deserialize, Serialize};

pub use file::{built_in, read, schema};
pub use reimport::Reimport;

use crate::archive::Depends;
use crate::calibrations::ConfigError;
use crate::settings::Shelf;
use crate::trial::{Trial, TrialError};
use crate::{Nursery, UnitError};
use rowscan_emulator::stage::Stage;

/// The classes of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Classes {
    /// What to call them.
    pub name: String,
    /// What they depart from.
    pub scene: Scene,
    /// The classes, those of an axis one after the other.
    pub classes: Vec<Class>,
    /// The files that their scenes name.
    #[serde(skip)]
    pub(crate) files: Shelf,
}

/// One class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Class {
    /// The property in which it differs from the others of its axis.
    pub axis: String,
    /// Its name.
    pub name: String,
    /// What grows and drives.
    pub scene: Scene,
    /// The rig that the estimator believes in, where it is not the scene's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub told: Option<Rig>,
    /// What becomes of the grown trees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reimport: Option<Reimport>,
}

impl Classes {
    /// The axes, in their order.
    pub fn axes(&self) -> Vec<&str> {
        let mut axes: Vec<&str> = Vec::new();
        for class in &self.classes {
            if !axes.contains(&class.axis.as_str()) {
                axes.push(&class.axis);
            }
        }
        axes
    }

    /// The classes of these axes only; all for an empty list.
    #[must_use]
    pub fn of_axes(mut self, axes: &[String]) -> Self {
        self.classes.retain(|class| axes.is_empty() || axes.contains(&class.axis));
        self
    }
}

impl Class {
    /// What grows for a seed.
    pub(crate) fn scene_of(&self, files: &Shelf, seed: u64) -> Result<Scene, String> {
        let mut scene = Scene { seed, ..self.scene.clone() };
        files.serve(&mut scene)?;
        Ok(scene)
    }

    /// All that a row of this seed depends on: not the class's names.
    pub(crate) fn depends(&self, files: &Shelf, seed: u64) -> Option<Depends> {
        let scene = self.scene_of(files, seed).ok()?;
        let rig = scene.resolved_rig();
        let model = self.told.as_ref().unwrap_or(&rig).scanners.first()?.model.as_str();
        // The calibration is asked for by the scene's own scanner.
        let own = rig.scanners.first()?.model.as_str();
        let depends = Depends::on_pass(&scene, own).and("told_model", &model);
        Some(depends.and("told", &self.told).and("reimport", &self.reimport))
    }

    /// Grows a row of this seed and drives past it, with the calibration that `calibration` gives for the rig.
    pub(crate) fn drive_past(
        &self,
        nursery: &Nursery,
        files: &Shelf,
        seed: u64,
        estimators: &[&'static EstimatorInfo],
        calibration: impl FnOnce(&Rig) -> Result<Option<Calibration>, ConfigError>,
    ) -> Result<Trial, UnitError> {
        let scene =
            self.scene_of(files, seed).map_err(|why| UnitError::Class { name: self.name.clone(), why })?;
        let mut stage = nursery.grow(scene)?;
        if let Some(reimport) = &self.reimport {
            stage = Stage::grow(reimport.scene(&stage), &|_, _| {})?;
        }
        let told = self.told.clone().unwrap_or_else(|| stage.rig.clone());
        let mount = told.scanners.first().map(|mount| mount.model.clone()).unwrap_or_default();
        let Some(scanner) = AnyModel::by_name(&mount) else {
            return Err(UnitError::UnknownModel { found: mount });
        };
        let calibration = calibration(&stage.rig)?;
        Trial::drive_past_told(&stage, &told, scanner, calibration, estimators)
            .map_err(|cause: TrialError| cause.into())
    }
}
