//! The study file.

use std::path::Path;

use rowscan_scenes::Scene;
use rowscan_scenes::files::{self, LoadError};
use serde::Deserialize;
use toml::Value;

use super::design::{Axis, Design, Span};
use super::{Output, SweepStudy};
use crate::StudyFileError;
use crate::complaint::Complaint;
use crate::document::Document;
use crate::settings::{self, Shelf};

/// Format of the file.
const VERSION: u32 = 1;
/// Units one study may hold.
const MOST_UNITS: usize = 1_000_000;

/// A study file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StudyFile {
    version: u32,
    #[serde(default)]
    name: String,
    scene: String,
    #[serde(default)]
    seed: Option<u64>,
    #[serde(default = "one")]
    repeats: usize,
    #[serde(default)]
    design: DesignName,
    #[serde(default)]
    points: Option<usize>,
    sweep: Vec<AxisFile>,
    keep: Vec<String>,
}

#[derive(Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum DesignName {
    #[default]
    Grid,
    LatinHypercube,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisFile {
    #[serde(default)]
    key: Option<String>,
    #[serde(default)]
    keys: Vec<String>,
    #[serde(default)]
    values: Vec<Value>,
    #[serde(default)]
    from: Option<f64>,
    #[serde(default)]
    to: Option<f64>,
    #[serde(default)]
    steps: Option<usize>,
}

fn one() -> usize {
    1
}

/// Reads a study. A scene that is a file is looked for beside it. `seed` and `repeats`, if given, are taken instead of the file's.
///
/// # Errors
/// A file that cannot be read, is no study, or names keys or values that its scene does not have.
pub fn read(path: &Path, seed: Option<u64>, repeats: Option<usize>) -> Result<SweepStudy, StudyFileError> {
    let document = Document::open(path)?;
    let file: StudyFile = document.parse()?;
    let (scene, files) = document.scene(&file.scene)?;
    let mut study = study(file, scene, seed, repeats).map_err(|complaint| document.refuse(complaint))?;
    study.files = study.stocked(files)?;
    Ok(study)
}

fn study(
    file: StudyFile,
    scene: Scene,
    seed: Option<u64>,
    repeats: Option<usize>,
) -> Result<SweepStudy, Complaint> {
    let refuse = |about: &str, message: String| Err(Complaint::new(about, message));
    if file.version != VERSION {
        return refuse("version", format!("version must be {VERSION}, found {}", file.version));
    }
    let design = match (file.design, file.points) {
        (DesignName::Grid, None) => Design::Grid,
        (DesignName::LatinHypercube, Some(points)) if points > 0 => Design::LatinHypercube { points },
        (DesignName::Grid, Some(_)) => {
            return refuse(
                "points",
                "a grid has as many points as its axes give; leave out `points`".to_owned(),
            );
        }
        (DesignName::LatinHypercube, _) => {
            return refuse("design", "a Latin hypercube needs `points`, a positive number".to_owned());
        }
    };
    let sweep: Vec<Axis> =
        file.sweep.into_iter().map(|axis| axis.checked(design)).collect::<Result<_, _>>()?;
    if sweep.is_empty() || file.keep.is_empty() {
        return refuse("keep", "a study needs a [[sweep]] and something to `keep`".to_owned());
    }
    let keep: Vec<Output> = file
        .keep
        .into_iter()
        .map(|name| Output::try_from(name.clone()).map_err(|cause| Complaint::new(name, cause.to_string())))
        .collect::<Result<_, _>>()?;
    let scene = Scene { seed: seed.or(file.seed).unwrap_or(scene.seed), ..scene };
    let repeats = repeats.unwrap_or(file.repeats);
    let files = Shelf::default();
    let study = SweepStudy { name: file.name, scene, repeats, design, sweep, keep, files };
    if study.repeats == 0 {
        return refuse("repeats", "expected `repeats` to be 1 or more, found 0".to_owned());
    }
    if study.points().saturating_mul(study.repeats) > MOST_UNITS {
        return refuse("sweep", format!("more than {MOST_UNITS} points × repeats; make the sweep coarser"));
    }
    // Every key must name something: tried with the axis' first value.
    for axis in &study.sweep {
        let about = axis.keys.first().cloned().unwrap_or_default();
        study.scene_with(axis, 0).map_err(|why| Complaint::new(about, format!("sweep {why}")))?;
    }
    Ok(study)
}

impl SweepStudy {
    /// The scene with one axis at one of its values.
    fn scene_with(&self, axis: &Axis, value: usize) -> Result<Scene, String> {
        let settings = Design::Grid.settings(std::slice::from_ref(axis), value, 0);
        settings::set(&self.scene, &settings, files::scene_from_text)
    }

    /// The shelf with every file that the scene, or a value of an axis, names.
    fn stocked(&self, mut files: Shelf) -> Result<Shelf, LoadError> {
        files.stock(&mut self.scene.clone())?;
        for axis in &self.sweep {
            // A value that cannot be is found out where it is tried, and told there.
            let scenes = (0..Design::Grid.points(std::slice::from_ref(axis)))
                .filter_map(|value| self.scene_with(axis, value).ok());
            for mut scene in scenes {
                files.stock(&mut scene)?;
            }
        }
        Ok(files)
    }
}

impl AxisFile {
    fn checked(self, design: Design) -> Result<Axis, Complaint> {
        let keys: Vec<String> = self.key.into_iter().chain(self.keys).collect();
        let name = keys.first().cloned().unwrap_or_else(|| "[[sweep]]".to_owned());
        let refuse = |message: &str| Err(Complaint::new(&name, format!("sweep key `{name}`: {message}")));
        if keys.is_empty() {
            return Err(Complaint::new(name, "a [[sweep]] needs a `key`, or `keys` that go together"));
        }
        let span = match (self.values, self.from, self.to) {
            (values, None, None) if !values.is_empty() => Span::Values(settings::tuples(&keys, values)?),
            (values, Some(from), Some(to)) if values.is_empty() => {
                if !(from.is_finite() && to.is_finite() && from < to) {
                    return refuse("expected `from` below `to`, both finite");
                }
                match (design, self.steps) {
                    (Design::Grid, Some(steps)) if steps >= 2 => Span::Range { from, to, steps },
                    (Design::Grid, _) => return refuse("a range in a grid needs `steps`, 2 or more"),
                    (Design::LatinHypercube { .. }, None) => Span::Range { from, to, steps: 2 },
                    (Design::LatinHypercube { .. }, Some(_)) => {
                        return refuse("a Latin hypercube cuts ranges itself; leave out `steps`");
                    }
                }
            }
            _ => return refuse("expected either `values`, or `from` and `to`"),
        };
        Ok(Axis { keys, span })
    }
}
