//! `rowscan demo --spray`: from scan to leaves in one run, with the reference controller.

use std::path::{Path, PathBuf};

use rowscan_check::SprayerRun;
use rowscan_ports::clock::Stopwatch;
use rowscan_sprayer::Boom;
use rowscan_study::spraying::{self, Controlled, SprayingError};

use super::blocking::off_runtime;
use super::interrupt::Interrupt;
use super::output::say;
use super::scene::{self, SceneArgs};
use super::score::{self, Titled};
use super::spray::{read_boom, say_nozzles_ahead};
use super::{Failure, Format, Outcome};

/// The boom where none is named.
const BOOM: &str = include_str!("../../sprayer/boom.toml");

/// What of `demo`'s flags counts here.
pub(super) struct Asked<'a> {
    pub(super) scene: &'a SceneArgs,
    pub(super) boom: Option<&'a Path>,
    pub(super) picture: Option<PathBuf>,
    pub(super) format: Format,
}

impl From<SprayingError> for Failure {
    fn from(error: SprayingError) -> Self {
        match error {
            SprayingError::Stage(error) => Self::Stage(error),
            error => Self::Usage(error.to_string()),
        }
    }
}

pub(super) async fn run(asked: Asked<'_>, interrupt: &mut Interrupt) -> Result<Outcome, Failure> {
    let watch = Stopwatch::start();
    let boom = match asked.boom {
        Some(path) => read_boom(path)?,
        None => Boom::read(BOOM).map_err(|error| Failure::Usage(error.to_string()))?,
    };
    let format = asked.picture.as_deref().map(score::picture_format).transpose()?;
    let mut scene = asked.scene.scene()?;
    if let Some(model) = asked.scene.named_model()? {
        scene.rig.scanners.iter_mut().for_each(|mount| mount.model = model.name().to_owned());
    }
    if scene.resolved_rig().speed_m_s == 0.0 && scene.drive == rowscan_vehicle::trajectory::Drive::default() {
        let why = "expected a speed above 0, found `speed_m_s = 0` in the rig: the tractor would never pass the row";
        return Err(Failure::Usage(why.to_owned()));
    }
    let Some(stage) = interrupt.or(scene::grow(scene)).await.transpose()? else {
        return Ok(Outcome::Interrupted(interrupt.signal().await));
    };
    say_nozzles_ahead(&boom, &stage.rig);
    let work = move || -> Result<(SprayerRun, u64, u64), Failure> {
        let seed = stage.scene.seed;
        let sprayed = spraying::spray(&stage, boom, Controlled::default())?;
        let run = SprayerRun::judged(sprayed.pass, sprayed.log, stage.orchard);
        // Rays take a moment: before anything is told.
        run.interception();
        Ok((run, seed, sprayed.scans))
    };
    let Some(ended) = interrupt.or(off_runtime("spray the row", work)).await else {
        return Ok(Outcome::Interrupted(interrupt.signal().await));
    };
    let (run, seed, scans) = ended?;
    say(format_args!(
        "{scans} scans, {} commands of the reference controller, seed {seed}; took {:.1} s",
        run.log.all().len(),
        watch.elapsed().as_secs_f64()
    ));
    let picture = asked.picture.as_deref().zip(format);
    score::tell(&run, None, (asked.format, picture), &Titled(format!("seed {seed}")))
}
