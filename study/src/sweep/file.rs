//! The study file.

use std::path::Path;

use rowscan_scenes::Scene;
use rowscan_scenes::files::{LoadError, Warning};
use rowscan_sprayer::Boom;
use serde::Deserialize;
use toml::Value;

use super::design::{Axis, Design, Span};
use super::{Output, SweepStudy, SweptSprayer};
use crate::StudyFileError;
use crate::complaint::Complaint;
use crate::document::Document;
use crate::settings::{self, Shelf};

/// Format of the file.
const VERSION: u32 = 1;
/// Parts a range is cut in for its effect, where no grid has its values.
const BINS: usize = 5;
/// More of them are no longer told apart.
const MOST_BINS: usize = 100;
/// Units one study may hold.
const MOST_UNITS: usize = 1_000_000;

/// A study file as it is written.
#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct StudyFile {
    /// Format of the file.
    #[schemars(range(min = 1, max = 1), example = 1)]
    version: u32,
    /// What to call it.
    #[serde(default)]
    name: String,
    /// The scene that every point departs from: a built-in one's name, or a file beside this one.
    #[schemars(example = &"spindle")]
    scene: String,
    /// Seed of the study, instead of the scene's own.
    #[serde(default)]
    #[schemars(example = 7)]
    seed: Option<u64>,
    /// Runs a point, each with a seed of its own.
    #[serde(default = "one")]
    #[schemars(range(min = 1))]
    repeats: usize,
    /// How axes are combined.
    #[serde(default)]
    design: DesignName,
    /// Points of a Latin hypercube; a grid has as many as its axes give.
    #[serde(default)]
    #[schemars(range(min = 1), example = 64)]
    points: Option<usize>,
    /// A sprayer's boom, a file beside this one: the reference controller sprays every row, keys that begin with `sprayer.` are its, and `spray.KEY` can be kept.
    #[serde(default)]
    #[schemars(example = &"boom.toml")]
    boom: Option<String>,
    /// What is varied: an axis each.
    sweep: Vec<AxisFile>,
    /// What is kept of every run; docs/studies.md lists the names.
    #[schemars(example = ["leaf_area_m2", "truth.leaf_area_m2"])]
    keep: Vec<String>,
}

#[derive(Clone, Copy, Default, PartialEq, Eq, serde::Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
enum DesignName {
    /// Every value of every axis with every other.
    #[default]
    Grid,
    /// So many points; each axis is cut in as many even parts, and every part is used once.
    LatinHypercube,
}

#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct AxisFile {
    /// The key of the scene that is varied.
    #[serde(default)]
    #[schemars(example = &"rig.speed_m_s")]
    key: Option<String>,
    /// Keys that are varied together.
    #[serde(default)]
    #[schemars(example = ["rig.scanner.distance_m", "rig.scanner.height_m"])]
    keys: Vec<String>,
    /// The values; of several keys, a list each.
    #[serde(default)]
    #[schemars(with = "Vec<serde_json::Value>", example = [0.5, 1.0, 2.0])]
    values: Vec<Value>,
    /// The smallest value, instead of `values`.
    #[serde(default)]
    #[schemars(example = 0.5)]
    from: Option<f64>,
    /// The greatest value.
    #[serde(default)]
    #[schemars(example = 2.0)]
    to: Option<f64>,
    /// Values from the smallest to the greatest, both among them; in a grid.
    #[serde(default)]
    #[schemars(range(min = 2), example = 4)]
    steps: Option<usize>,
    /// Parts that the range is cut in for tables and figures, where the design is no grid [5].
    #[serde(default)]
    #[schemars(range(min = 1), example = 8)]
    bins: Option<usize>,
}

fn one() -> usize {
    1
}

/// The tables of a study file.
pub fn schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
    generator.subschema_for::<StudyFile>()
}

/// Reads a study. A scene that is a file is looked for beside it; `tell` hears what the user should know of it. `seed` and `repeats`, if given, are
/// taken instead of the file's.
///
/// # Errors
/// A file that cannot be read, is no study, or names keys or values that its scene does not have.
pub fn read(
    path: &Path,
    seed: Option<u64>,
    repeats: Option<usize>,
    tell: impl FnMut(Warning),
) -> Result<SweepStudy, StudyFileError> {
    let document = Document::open(path)?;
    let file: StudyFile = document.parse()?;
    let (scene, files) = document.scene(&file.scene, tell)?;
    let sprayer = file.boom.as_deref().map(|name| boom_beside(path, name)).transpose();
    let sprayer = sprayer.map_err(|complaint| document.refuse(complaint))?;
    let mut study =
        study(file, (scene, sprayer), seed, repeats).map_err(|complaint| document.refuse(complaint))?;
    study.files = study.stocked(files)?;
    Ok(study)
}

/// The boom in a file beside the study.
fn boom_beside(study: &Path, name: &str) -> Result<SweptSprayer, Complaint> {
    let path = study.parent().map_or_else(|| name.into(), |folder| folder.join(name));
    let refuse = |why: String| Complaint::new("boom", format!("`boom`: {}: {why}", path.display()));
    let text = rowscan_files::read_text(&path).map_err(|cause| refuse(cause.to_string()))?;
    let boom = Boom::read(&text).map_err(|error| refuse(error.to_string()))?;
    Ok(SweptSprayer { boom, latency_ms: 0.0, sections: None, least_beams: None })
}

fn study(
    file: StudyFile,
    (scene, sprayer): (Scene, Option<SweptSprayer>),
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
    // A key that takes whole numbers alone refuses 2.0.
    let is_of_sprayer = |axis: &Axis| sprayer.is_some() && axis.keys.iter().any(|key| SweptSprayer::has(key));
    let sweep: Vec<Axis> = sweep
        .into_iter()
        .map(|axis| if is_of_sprayer(&axis) { axis } else { as_it_takes(axis, &scene, design) })
        .collect();
    let keep: Vec<Output> = file
        .keep
        .into_iter()
        .map(|name| Output::try_from(name.clone()).map_err(|cause| Complaint::new(name, cause.to_string())))
        .collect::<Result<_, _>>()?;
    if let Some(output) = keep.iter().find(|output| output.of_sprayer().is_some() && sprayer.is_none()) {
        return refuse(
            output.name(),
            format!("`{}` needs a sprayer: name its boom, `boom = \"boom.toml\"`", output.name()),
        );
    }
    let scene = Scene { seed: seed.or(file.seed).unwrap_or(scene.seed), ..scene };
    let repeats = repeats.unwrap_or(file.repeats);
    let files = Shelf::default();
    let study = SweepStudy { name: file.name, scene, repeats, design, sweep, keep, sprayer, files };
    if study.repeats == 0 {
        return refuse("repeats", "expected `repeats` to be 1 or more, found 0".to_owned());
    }
    if study.points().saturating_mul(study.repeats) > MOST_UNITS {
        return refuse("sweep", format!("more than {MOST_UNITS} points × repeats; make the sweep coarser"));
    }
    // Every key must name something: tried with the axis' first value.
    for axis in &study.sweep {
        let about = axis.keys.first().cloned().unwrap_or_default();
        let tried = study.scene_with(axis, 0).and_then(|_| study.looks_at(axis));
        tried.map_err(|why| Complaint::new(about, format!("sweep {why}")))?;
    }
    Ok(study)
}

/// The axis in whole numbers if its keys take no others.
fn as_it_takes(axis: Axis, scene: &Scene, design: Design) -> Axis {
    let is_taken = |axis: &Axis| {
        let settings = Design::Grid.settings(std::slice::from_ref(axis), 0, 0);
        settings::set_in_scene(scene, &settings).is_ok()
    };
    match axis.whole(design).filter(|whole| !is_taken(&axis) && is_taken(whole)) {
        Some(whole) => whole,
        None => axis,
    }
}

impl SweepStudy {
    /// The scene with one axis at one of its values.
    fn scene_with(&self, axis: &Axis, value: usize) -> Result<Scene, String> {
        let settings = Design::Grid.settings(std::slice::from_ref(axis), value, 0);
        if let Some(sprayer) = &self.sprayer {
            sprayer.with(&settings)?;
        }
        settings::set_in_scene(&self.scene, &self.of_scene(settings))
    }

    /// A sprayer looks through all scanners of its rig, everything else through the first.
    fn looks_at(&self, axis: &Axis) -> Result<(), String> {
        if self.sprayer.is_some() {
            return Ok(());
        }
        settings::of_first_scanner(axis.keys.iter().map(String::as_str))
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
                let steps = match (design, self.steps, self.bins) {
                    (Design::Grid, _, Some(_)) => {
                        return refuse("a grid is told at its own values; leave out `bins`");
                    }
                    (Design::Grid, Some(steps), None) if steps >= 2 => steps,
                    (Design::Grid, ..) => return refuse("a range in a grid needs `steps`, 2 or more"),
                    (Design::LatinHypercube { .. }, None, None) => BINS,
                    (Design::LatinHypercube { .. }, None, Some(bins)) if (1..=MOST_BINS).contains(&bins) => {
                        bins
                    }
                    (Design::LatinHypercube { .. }, None, Some(_)) => {
                        return refuse("expected `bins` from 1 to 100");
                    }
                    (Design::LatinHypercube { .. }, Some(_), _) => {
                        return refuse("a Latin hypercube cuts ranges itself; leave out `steps`");
                    }
                };
                Span::Range { from, to, steps, whole: false }
            }
            _ => return refuse("expected either `values`, or `from` and `to`"),
        };
        Ok(Axis { keys, span })
    }
}
