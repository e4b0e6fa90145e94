//! The search's file.

use std::collections::BTreeMap;
use std::path::Path;

use rowscan_scenes::files::Warning;
use serde::Deserialize;
use toml::{Table, Value};

use super::{AreasStudy, Knob, SearchStudy, with};
use crate::complaint::Complaint;
use crate::document::Document;
use crate::settings::{Shelf, tuples};
use crate::{Setting, StudyFileError};

/// Format of the file.
const VERSION: u32 = 1;
/// Units one search may hold.
const MOST_UNITS: usize = 1_000_000;

#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct SearchFile {
    /// Format of the file.
    #[schemars(range(min = 1, max = 1), example = 1)]
    version: u32,
    /// What to call it.
    #[serde(default)]
    name: String,
    /// The scene that every point departs from: a built-in one's name, or a file beside this one.
    #[schemars(example = &"paper")]
    scene: String,
    /// The seeds that every point sees.
    #[schemars(example = [1, 2, 3])]
    seeds: Vec<u64>,
    /// Seeds that earlier searches have seen: a confirmation may use none of them.
    #[serde(default)]
    #[schemars(example = [4, 5])]
    seen: Vec<u64>,
    /// Try every value of every knob alone.
    #[serde(default)]
    one_at_a_time: bool,
    /// Points at which all knobs are drawn together.
    #[serde(default)]
    joint: usize,
    /// What the base sets over the areas study on the scene: keys, in quotes, with their values.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>", example = base_example())]
    base: Table,
    /// What is tried: a knob each.
    #[serde(default)]
    knob: Vec<KnobFile>,
}

#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct KnobFile {
    /// The key of the areas study that is tried.
    #[serde(default)]
    #[schemars(example = &"scene.orchard.tree.pruned")]
    key: Option<String>,
    /// Keys that are tried together.
    #[serde(default)]
    #[schemars(example = ["lateral.height_m", "zenith.height_m"])]
    keys: Vec<String>,
    /// The values; of several keys, a list each.
    #[schemars(with = "Vec<serde_json::Value>", example = [true, false])]
    values: Vec<Value>,
}

fn base_example() -> BTreeMap<String, bool> {
    BTreeMap::from([("whole_orchard".to_owned(), true)])
}

/// The tables of a search file.
pub fn schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
    generator.subschema_for::<SearchFile>()
}

/// Reads a search. A scene that is a file is looked for beside it; `tell` hears what the user should know of it.
///
/// # Errors
/// A file that cannot be read, is no search, or names keys or values that an areas study does not have.
pub fn read(path: &Path, tell: impl FnMut(Warning)) -> Result<SearchStudy, StudyFileError> {
    let document = Document::open(path)?;
    let file: SearchFile = document.parse()?;
    let (scene, mut files) = document.scene(&file.scene, tell)?;
    files.stock(&mut scene.clone())?;
    let mut search = file.search(AreasStudy::new(scene)).map_err(|complaint| document.refuse(complaint))?;
    // Every value of every knob must be one, tried alone; what does not go together shows in the search.
    for knob in &search.knobs {
        for value in &knob.values {
            let about = knob.keys.first().cloned().unwrap_or_default();
            let mut tried = with(&search.base, &knob.set_to(value).collect::<Vec<_>>())
                .map_err(|why| document.refuse(Complaint::new(about, why)))?;
            files.stock(&mut tried.scene)?;
        }
    }
    search.files = files;
    Ok(search)
}

impl SearchFile {
    fn search(self, base: AreasStudy) -> Result<SearchStudy, Complaint> {
        if self.version != VERSION {
            let message = format!("version must be {VERSION}, found {}", self.version);
            return Err(Complaint::new("version", message));
        }
        if self.seeds.is_empty() {
            return Err(Complaint::new(
                "seeds",
                "expected `seeds`, the list that every point sees, found none",
            ));
        }
        let settings: Vec<Setting<'_>> =
            self.base.iter().map(|(key, value)| (key.as_str(), value.clone())).collect();
        let base = with(&base, &settings).map_err(|why| {
            let alone = settings.iter().find(|one| with(&base, std::slice::from_ref(one)).is_err());
            Complaint::new(alone.map_or("[base]", |(key, _)| key), why)
        })?;
        let search = SearchStudy {
            name: self.name,
            base,
            knobs: self.knob.into_iter().map(KnobFile::checked).collect::<Result<_, _>>()?,
            one_at_a_time: self.one_at_a_time,
            joint: self.joint,
            seeds: self.seeds,
            seen: self.seen,
            files: Shelf::default(),
        };
        if search.points().saturating_mul(search.seeds.len()) > MOST_UNITS {
            let message = format!("more than {MOST_UNITS} points × seeds; lower `joint`");
            return Err(Complaint::new("joint", message));
        }
        Ok(search)
    }
}

impl KnobFile {
    fn checked(self) -> Result<Knob, Complaint> {
        let keys: Vec<String> = self.key.into_iter().chain(self.keys).collect();
        if keys.is_empty() || self.values.is_empty() {
            let name = keys.join("`, `");
            let message =
                format!("a [[knob]] needs a `key`, or `keys` that go together, and `values`, found `{name}`");
            return Err(Complaint::new(keys.first().map_or("[[knob]]", String::as_str), message));
        }
        Ok(Knob { values: tuples(&keys, self.values)?, keys })
    }
}
