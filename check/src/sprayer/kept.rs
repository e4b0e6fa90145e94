//! A sprayer's run as a file: `sprayer.json` in the folder of a run that is kept. It holds all that its scores follow from.

use std::path::{Path, PathBuf};

use rowscan_files::OutputFile;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::files::{LoadError, fill};
use rowscan_scenes::{GrowError, Orchard, Scene};
use rowscan_sprayer::{Boom, Command, Drive, Pass, Target, Troubles};
use serde::{Deserialize, Serialize};

use super::run::SprayerRun;

/// The file in the run's folder.
const NAME: &str = "sprayer.json";
/// The largest that is read.
const LARGEST: u64 = 1024 * 1024 * 1024;
/// Its format.
const VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
struct File {
    version: u32,
    /// Where files are that the scene names.
    scene_folder: PathBuf,
    scene: Scene,
    boom: Boom,
    drive: Drive,
    commands: Vec<Said>,
    /// Seconds, and the litres that the controller reported.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    reports: Vec<(f64, f64)>,
    /// What went wrong with it.
    #[serde(default, skip_serializing_if = "Troubles::is_empty")]
    troubles: Troubles,
    /// Why the run ended before its end; absent where it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cut_off: Option<String>,
}

/// A command.
#[derive(Serialize, Deserialize)]
struct Said {
    t_ns: u64,
    target: Target,
    duty: f64,
}

/// Why a run's scores cannot be told.
#[derive(Debug, thiserror::Error)]
pub enum KeptError {
    /// The file cannot be read.
    #[error("cannot read {}: {cause}; expected the folder of a run with a sprayer that `check --keep` kept", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        cause: std::io::Error,
    },
    /// The file is no such run.
    #[error("{}: expected a sprayer's run of version 1: {why}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// Several runs.
    #[error("{}: expected one run, found {}: name one of them", folder.display(), runs.join(", "))]
    Several {
        /// The folder that was named.
        folder: PathBuf,
        /// The runs in it.
        runs: Vec<String>,
    },
    /// A file that the scene names.
    #[error(transparent)]
    Scene(#[from] LoadError),
    /// The orchard.
    #[error("the run's orchard cannot be grown again: {0}")]
    Grow(#[from] GrowError),
}

impl SprayerRun {
    /// Writes it to the folder of its run; `scene_folder` has the files that the scene names.
    pub(crate) fn keep(&self, folder: &Path, scene_folder: &Path, scene: &Scene) -> std::io::Result<()> {
        let said =
            |command: &Command| Said { t_ns: command.at.0, target: command.target, duty: command.duty };
        let file = File {
            version: VERSION,
            scene_folder: std::path::absolute(scene_folder)?,
            scene: scene.clone(),
            boom: self.pass.boom().clone(),
            drive: self.pass.drive().clone(),
            commands: self.log.all().iter().map(said).collect(),
            reports: self.reports.clone(),
            troubles: self.pass.troubles().clone(),
            cut_off: self.cut_off.clone(),
        };
        let text = serde_json::to_string(&file).map_err(std::io::Error::other)?;
        OutputFile::create(&folder.join(NAME))?.write_whole(text.as_bytes())
    }

    /// Reads the run kept in `folder`, or the only one below it, or in the file that is named, and grows its orchard again.
    ///
    /// # Errors
    /// No such run or several, content that is none, an orchard that cannot be grown.
    pub fn load(folder: &Path) -> Result<Self, KeptError> {
        let path = found(folder)?;
        let bytes = rowscan_files::read(&path, LARGEST)
            .map_err(|cause| KeptError::Read { path: path.clone(), cause })?;
        let content = |why: String| KeptError::Content { path: path.clone(), why };
        let file: File = serde_json::from_slice(&bytes).map_err(|error| content(error.to_string()))?;
        let File { version, scene_folder, mut scene, boom, drive, commands, reports, troubles, cut_off } =
            file;
        if version != VERSION {
            return Err(content(format!("found version {version}")));
        }
        if let Some((number, said)) = (1..).zip(&commands).find(|(_, said)| !(0.0..=1.0).contains(&said.duty))
        {
            let Said { t_ns, duty, .. } = said;
            return Err(content(format!(
                "command {number} of `commands`, at {t_ns} ns: expected a `duty` from 0 to 1, found {duty}"
            )));
        }
        let boom = boom.settled().map_err(|error| content(error.to_string()))?;
        for file in scene.files_mut() {
            fill(file, &scene_folder)?;
        }
        scene.validate().map_err(|error| content(error.to_string()))?;
        let orchard = Orchard::grow(&scene.orchard, scene.seed, &|_, _| {})?.beside(&scene.drive);
        let commands = commands.into_iter();
        let log = commands
            .map(|said| Command { at: SimTime(said.t_ns), target: said.target, duty: said.duty })
            .collect();
        let pass = Pass::new(boom, &orchard, drive, scene.seed).with_troubles(troubles);
        let mut run = Self::judged(pass, log, orchard.into());
        (run.reports, run.scene, run.cut_off) = (reports, Some(scene), cut_off);
        Ok(run)
    }
}

/// How deep below the folder of `--keep` runs are.
const DEPTH: u32 = 2;

/// The file itself, that of the folder where a run was kept in it, else the only one below it.
fn found(folder: &Path) -> Result<PathBuf, KeptError> {
    // A file of any kind; what is not there is a folder that is missed.
    if folder.exists() && !folder.is_dir() {
        return Ok(folder.to_owned());
    }
    let mut runs = Vec::new();
    look(folder, DEPTH, &mut runs);
    match runs.as_slice() {
        [] => Ok(folder.join(NAME)),
        [one] => Ok(one.join(NAME)),
        all => Err(KeptError::Several {
            folder: folder.to_owned(),
            runs: all.iter().map(|run| run.display().to_string()).collect(),
        }),
    }
}

fn look(folder: &Path, depth: u32, runs: &mut Vec<PathBuf>) {
    if folder.join(NAME).is_file() {
        runs.push(folder.to_owned());
        return;
    }
    let below = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut below: Vec<PathBuf> = below.filter(|path| path.is_dir() && depth > 0).collect();
    below.sort();
    below.iter().for_each(|folder| look(folder, depth - 1, runs));
}
