//! The study file.

use std::path::Path;

use rowscan_scenes::Scene;
use serde::Deserialize;
use toml::Value;

use super::design::{Axis, Design, Span};
use super::{Output, SweepStudy, keys};
use crate::config::{self, ConfigError, Trouble};

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

/// Why a file is no study. Each message names the place and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// It cannot be read.
    #[error("cannot read the study {path}: {cause}")]
    Read {
        /// The file.
        path: String,
        /// What the system said.
        cause: std::io::Error,
    },
    /// It is not what it should be.
    #[error("{path}:{}: {}", trouble.line, trouble.message)]
    Content {
        /// The file.
        path: String,
        /// What is wrong, and where.
        trouble: Trouble,
    },
    /// Its scene cannot be used.
    #[error("the study's scene: {0}")]
    Scene(#[from] ConfigError),
}

/// Reads a study. A scene that is a file is looked for beside it. `seed` and `repeats`, if given, are taken instead of the file's.
pub fn read(path: &Path, seed: Option<u64>, repeats: Option<usize>) -> Result<SweepStudy, SweepError> {
    let place = path.display().to_string();
    let text =
        std::fs::read_to_string(path).map_err(|cause| SweepError::Read { path: place.clone(), cause })?;
    let content = |trouble| SweepError::Content { path: place.clone(), trouble };
    let file: StudyFile = config::from_toml(&text).map_err(content)?;
    let beside = path.parent().map(|folder| folder.join(&file.scene)).filter(|beside| beside.is_file());
    let scene = config::load_scene(beside.as_deref().and_then(Path::to_str).unwrap_or(&file.scene))?;
    study(file, scene, seed, repeats).map_err(|(about, message)| {
        // The line that holds what the complaint is about, as it is quoted there.
        let quoted = format!("\"{about}\"");
        let holds = |line: &str| line.contains(&quoted) || line.trim_start().starts_with(about.as_str());
        let line = text.lines().position(holds).map_or(0, |index| index + 1);
        content(Trouble { line, message })
    })
}

/// What is wrong: the text it is about, and the message.
type Complaint = (String, String);

fn study(
    file: StudyFile,
    scene: Scene,
    seed: Option<u64>,
    repeats: Option<usize>,
) -> Result<SweepStudy, Complaint> {
    let refuse = |about: &str, message: String| Err((about.to_owned(), message));
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
        .map(|name| Output::try_from(name.clone()).map_err(|cause| (name, cause.to_string())))
        .collect::<Result<_, _>>()?;
    let scene = Scene { seed: seed.or(file.seed).unwrap_or(scene.seed), ..scene };
    let study =
        SweepStudy { name: file.name, scene, repeats: repeats.unwrap_or(file.repeats), design, sweep, keep };
    if study.repeats == 0 {
        return refuse("repeats", "expected `repeats` to be 1 or more, found 0".to_owned());
    }
    if study.points().saturating_mul(study.repeats) > MOST_UNITS {
        return refuse("sweep", format!("more than {MOST_UNITS} points × repeats; make the sweep coarser"));
    }
    // Every key must name something: tried with the axis' first value.
    for axis in &study.sweep {
        let settings = Design::Grid.settings(std::slice::from_ref(axis), 0, 0);
        keys::set(&study.scene, &settings)
            .map_err(|why| (axis.keys.first().cloned().unwrap_or_default(), format!("sweep {why}")))?;
    }
    Ok(study)
}

impl AxisFile {
    fn checked(self, design: Design) -> Result<Axis, Complaint> {
        let keys: Vec<String> = self.key.into_iter().chain(self.keys).collect();
        let name = keys.first().cloned().unwrap_or_else(|| "[[sweep]]".to_owned());
        let refuse = |message: &str| Err((name.clone(), format!("sweep key `{name}`: {message}")));
        if keys.is_empty() {
            return Err((name, "a [[sweep]] needs a `key`, or `keys` that go together".to_owned()));
        }
        let span = match (self.values, self.from, self.to) {
            (values, None, None) if !values.is_empty() => {
                let single = keys.len() == 1;
                let tuple = |value: Value| match value {
                    Value::Array(items) if !single => items,
                    value => vec![value],
                };
                let values: Vec<Vec<Value>> = values.into_iter().map(tuple).collect();
                if values.iter().any(|tuple| tuple.len() != keys.len()) {
                    return refuse("expected every value to be a list with one entry a key");
                }
                Span::Values(values)
            }
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
