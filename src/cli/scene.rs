//! The flags every command has that grows a scene.

use std::ops::Deref;

use rowscan_protocol::model::{AnyModel, Model};
use rowscan_protocol::rig::Rig;
use rowscan_scenes::files::{self, Warning};
use rowscan_scenes::optics::{self, Stages};
use rowscan_scenes::{GrowError, Scene};

use super::blocking::off_runtime;
use super::output::say;
use super::{Failure, models, progress};
use rowscan_emulator::stage::Stage;

/// Which scene, which seed, which scanner.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct SceneArgs {
    #[command(flatten)]
    rows: RowSceneArgs,
    /// Seed of everything random, instead of the scene's own
    #[arg(long, value_name = "N")]
    pub(super) seed: Option<u64>,
}

/// The same of a study of many rows, which has seeds of its own.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct RowSceneArgs {
    /// A scene file, or the name of a built-in scene
    #[arg(value_name = "SCENE", default_value = "spindle")]
    pub(super) name: String,
    /// Scanner model, instead of the rig's own; see `rowscan models`
    #[arg(long, value_name = "NAME", value_parser = models::name(), hide_possible_values = true)]
    model: Option<String>,
    #[command(flatten)]
    optics: OpticsArgs,
}

/// How scanners see.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct OpticsArgs {
    /// How scanners see, instead of the scene's own: `ideal`, `device`, or stages with commas between them; docs/optics.md
    #[arg(long, value_name = "STAGES")]
    optics: Option<Stages>,
}

impl OpticsArgs {
    /// The scene of this name with these optics.
    pub(super) fn load(&self, name: &str) -> Result<Scene, Failure> {
        let tell = |warning| match (&warning, self.optics) {
            // Which stages are on is the flag's to say, not the file's.
            (Warning::AirIsOff { .. }, Some(stages)) if stages.has(optics::Stage::Air) => {}
            (Warning::OtherOptics { rig, .. }, Some(stages)) if *rig == stages.beam_width() => {}
            _ => say(warning),
        };
        let mut scene = files::load_scene(name, tell)?;
        scene.optics.stages = self.optics.unwrap_or(scene.optics.stages);
        Ok(scene)
    }
}

impl Deref for SceneArgs {
    type Target = RowSceneArgs;

    fn deref(&self) -> &RowSceneArgs {
        &self.rows
    }
}

impl SceneArgs {
    /// The scene with its seed.
    pub(super) fn scene(&self) -> Result<Scene, Failure> {
        let mut scene = self.rows.scene()?;
        scene.seed = self.seed.unwrap_or(scene.seed);
        Ok(scene)
    }

    /// The scene, grown, with a progress bar.
    pub(super) async fn stage(&self) -> Result<Stage, Failure> {
        grow(self.scene()?).await
    }
}

impl RowSceneArgs {
    /// Whether its beams are as wide as the command line says, whatever the scene's file has.
    pub(super) fn tells_optics(&self) -> bool {
        self.optics.optics.is_some()
    }

    /// The scene, with the seed of its file.
    pub(super) fn scene(&self) -> Result<Scene, Failure> {
        // A model that does not exist is told before an orchard has been grown for it.
        self.model.as_deref().map(models::find).transpose()?;
        self.optics.load(&self.name)
    }

    /// The scanner model: the one asked for, or the rig's; one that speaks CoLa.
    pub(super) fn model(&self, rig: &Rig, scanner: usize) -> Result<&'static Model, Failure> {
        match self.any_model(rig, scanner)? {
            AnyModel::Cola(model) => Ok(model),
            AnyModel::Lms2xx(model) => Err(Failure::Usage(format!(
                "{} speaks on a serial line, which this command does not have; `rowscan emulate` and `rowscan demo --line pty` do",
                model.title
            ))),
        }
    }

    /// The model the flags name, if they name one.
    pub(super) fn named_model(&self) -> Result<Option<AnyModel>, Failure> {
        self.model.as_deref().map(models::find).transpose()
    }

    /// The same, of either family.
    pub(super) fn any_model(&self, rig: &Rig, scanner: usize) -> Result<AnyModel, Failure> {
        let mounted = || rig.scanners.get(scanner).map(|mount| mount.model.as_str());
        models::find(self.model.as_deref().or_else(mounted).unwrap_or_default())
    }
}

/// Grows a scene off the runtime's threads, with a progress bar.
pub(super) async fn grow(scene: Scene) -> Result<Stage, Failure> {
    let bar = progress::bar("growing", "trees", 0);
    let work = move || -> Result<Stage, GrowError> {
        let stage = Stage::grow(scene, &|done, of| {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
        });
        bar.finish_and_clear();
        stage
    };
    let stage = off_runtime("grow the orchard", work).await?;
    tell(&stage);
    Ok(stage)
}

/// Says what was done to the input that the user did not ask for word by word.
pub(super) fn tell(stage: &Stage) {
    stage.orchard.remarks().iter().for_each(say);
    let stages = stage.scene.optics.stages;
    if stages.has(optics::Stage::Spot) {
        say(format_args!(
            "optics {stages}: leaf areas are corrected for the spot, the impacted area is not; docs/optics.md says how well"
        ));
    }
}
