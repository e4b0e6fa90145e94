//! Studies of anything: a file names keys of a scene or its rig to sweep, and the outputs to keep.
//!
//! Every point of the design is tried on the same `repeats` orchards (seeds hash(study, seed, repeat)), so that points differ by their
//! settings and not by their trees. A point that no scanner or orchard allows is kept as refused, with the reason.

mod design;
mod file;
mod outputs;
mod report;
mod sprayer;

use rowscan_protocol::model::AnyModel;
use rowscan_scenes::Scene;
use rowscan_scenes::parameters::SceneFile;
use serde::{Deserialize, Serialize};

pub use design::{Axis, Design};
pub use file::{read, schema};
pub use outputs::{Output, OutputError};
pub use report::{Effect, SweepReport, report};
pub use sprayer::SweptSprayer;

use super::settings::{self, Shelf};
use super::{Nursery, Setting, Study, UnitError, fingerprint};
use crate::appraisal::Appraisal;
use crate::archive::Depends;
use crate::calibrations;
use crate::notes::RowNotes;
use crate::trial::{Trial, TrialError};

/// A sweep: all that its results depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepStudy {
    /// What to call it.
    pub name: String,
    /// The scene that the points depart from; its seed is the study's.
    pub scene: Scene,
    /// Orchards a point.
    pub repeats: usize,
    /// How the axes are combined.
    pub design: Design,
    /// What is swept.
    pub sweep: Vec<Axis>,
    /// What is kept.
    pub keep: Vec<Output>,
    /// What sprays the rows, where the study is of a sprayer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sprayer: Option<SweptSprayer>,
    /// What its scenes name.
    #[serde(skip)]
    files: Shelf,
}

/// One orchard at one point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tried {
    /// The orchard's seed.
    pub seed: u64,
    /// The outputs, in the order of `keep`; null where one has no value.
    pub kept: Vec<Option<f64>>,
    /// Why the point cannot be tried, if it cannot.
    pub refused: Option<String>,
}

impl SweepStudy {
    /// Points of the design.
    pub fn points(&self) -> usize {
        self.design.points(&self.sweep)
    }

    /// Point and repeat of a unit.
    pub fn case(&self, index: usize) -> (usize, usize) {
        (index / self.repeats.max(1), index % self.repeats.max(1))
    }

    /// The keys set at a point, with their values.
    pub fn settings(&self, point: usize) -> Vec<Setting<'_>> {
        self.design.settings(&self.sweep, point, self.scene.seed)
    }

    /// The scene at a point.
    fn scene_at(&self, point: usize, repeat: usize) -> Result<Scene, String> {
        let settings = self.of_scene(self.settings(point));
        let mut scene = settings::set_in_scene(&self.scene, &settings)?;
        self.files.serve(&mut scene)?;
        if settings.iter().any(|(key, _)| *key == "seed") {
            return Ok(scene);
        }
        Ok(Scene { seed: fingerprint::seed(Self::NAME, self.scene.seed, repeat), ..scene })
    }

    /// The settings that are not of the sprayer.
    fn of_scene<'a>(&self, settings: Vec<Setting<'a>>) -> Vec<Setting<'a>> {
        let is_left = |key: &str| self.sprayer.is_none() || !SweptSprayer::has(key);
        settings.into_iter().filter(|(key, _)| is_left(key)).collect()
    }

    /// The sprayer at a point.
    fn sprayer_at(&self, point: usize) -> Result<Option<SweptSprayer>, String> {
        self.sprayer.as_ref().map(|sprayer| sprayer.with(&self.settings(point))).transpose()
    }

    fn try_scene(
        &self,
        scene: Scene,
        sprayer: Option<&SweptSprayer>,
        nursery: &Nursery,
        notes: &mut RowNotes,
    ) -> Result<Vec<Option<f64>>, UnitError> {
        let rig = scene.resolved_rig();
        let mount = rig.scanners.first().cloned().unwrap_or_default();
        let Some(scanner) = AnyModel::by_name(&mount.model) else {
            return Err(UnitError::UnknownModel { found: mount.model });
        };
        let stage = nursery.grow(scene)?;
        let keys: Vec<&str> = self.keep.iter().filter_map(Output::of_sprayer).collect();
        let sprayed = match sprayer {
            Some(sprayer) if !keys.is_empty() => sprayer.spray(&stage, &keys)?,
            _ => vec![None; keys.len()],
        };
        if keys.len() == self.keep.len() {
            return Ok(sprayed);
        }
        let calibration = calibrations::of_rig(&stage.rig)?;
        let trial = Trial::drive_past(&stage, scanner, calibration, &outputs::estimators(&self.keep))?;
        notes.add(&trial.estimate);
        let asked = self.keep.iter().filter_map(Output::true_quantity);
        let appraisal = Appraisal::of_quantities(
            (&stage.orchard, stage.row_seen(0)),
            &mount,
            rig.ground_clearance_m,
            asked,
        );
        let truth = appraisal.stretch(rig.start_m, rig.start_m + trial.length_m);
        let mut sprayed = sprayed.into_iter();
        let value = |output: &Output| match output.of_sprayer() {
            Some(_) => sprayed.next().flatten(),
            None => output.value(&trial.estimate, &truth),
        };
        Ok(self.keep.iter().map(value).collect())
    }
}

impl Study for SweepStudy {
    const NAME: &'static str = "sweep";
    type Result = Tried;

    fn units(&self) -> usize {
        self.points() * self.repeats
    }

    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn files(&self) -> Vec<SceneFile> {
        self.files.files()
    }

    fn effort(&self, _index: usize) -> f64 {
        1.0
    }

    fn depends(&self, index: usize) -> Option<Depends> {
        let (point, repeat) = self.case(index);
        let scene = self.scene_at(point, repeat).ok()?;
        let sprayer = self.sprayer_at(point).ok()?;
        let model = scene.resolved_rig().scanners.first().cloned().unwrap_or_default().model;
        Some(Depends::on_pass(&scene, &model).and("keep", &self.keep).and("sprayer", &sprayer))
    }

    fn grown(&self, index: usize) -> Option<Scene> {
        let (point, repeat) = self.case(index);
        self.scene_at(point, repeat).ok()
    }

    fn unit(&self, index: usize, nursery: &Nursery, notes: &mut RowNotes) -> Result<Tried, UnitError> {
        let (point, repeat) = self.case(index);
        let refused =
            |seed, why: String| Tried { seed, kept: vec![None; self.keep.len()], refused: Some(why) };
        let at = self.scene_at(point, repeat).and_then(|scene| Ok((scene, self.sprayer_at(point)?)));
        let (scene, sprayer) = match at {
            Ok(at) => at,
            Err(why) => return Ok(refused(self.scene.seed, why)),
        };
        let seed = scene.seed;
        match self.try_scene(scene, sprayer.as_ref(), nursery, notes) {
            Ok(kept) => Ok(Tried { seed, kept, refused: None }),
            // A combination that cannot be is a finding of the sweep, not its end.
            Err(
                why @ (UnitError::Grow(_)
                | UnitError::UnknownModel { .. }
                | UnitError::Spraying(_)
                | UnitError::Trial(TrialError::Stage(_) | TrialError::Reading(_))),
            ) => Ok(refused(seed, why.to_string())),
            Err(failure) => Err(failure),
        }
    }
}
