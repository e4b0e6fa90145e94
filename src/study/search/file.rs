//! The search's file.

use std::path::Path;

use serde::Deserialize;
use serde_json::{Map, Value};

use super::{AreasStudy, Knob, SearchStudy, keys};
use crate::config::{self, ConfigError};

/// Format of the file.
const VERSION: u32 = 1;
/// Units one search may hold.
const MOST_UNITS: usize = 1_000_000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SearchFile {
    version: u32,
    #[serde(default)]
    name: String,
    scene: String,
    seeds: Vec<u64>,
    #[serde(default)]
    one_at_a_time: bool,
    #[serde(default)]
    joint: usize,
    /// What the base sets over the areas study on the scene: keys, in quotes, with their values.
    #[serde(default)]
    base: Map<String, Value>,
    #[serde(default)]
    knob: Vec<KnobFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KnobFile {
    #[serde(default)]
    key: Option<String>,
    #[serde(default)]
    keys: Vec<String>,
    values: Vec<Value>,
}

/// Why a file is no search.
#[derive(Debug, thiserror::Error)]
pub enum SearchFileError {
    /// It cannot be read.
    #[error("cannot read the search {path}: {cause}")]
    Read {
        /// The file.
        path: String,
        /// What the system said.
        cause: std::io::Error,
    },
    /// It is not what it should be.
    #[error("{path}: {why}")]
    Content {
        /// The file.
        path: String,
        /// What is wrong.
        why: String,
    },
    /// Its scene cannot be used.
    #[error("the search's scene: {0}")]
    Scene(#[from] ConfigError),
}

/// Reads a search.
///
/// # Errors
/// A file that cannot be read, is no search, or names keys or values that an areas study does not have.
pub fn read(path: &Path) -> Result<SearchStudy, SearchFileError> {
    let place = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|cause| SearchFileError::Read { path: place.clone(), cause })?;
    let content = |why| SearchFileError::Content { path: place.clone(), why };
    let file: SearchFile = toml::from_str(&text).map_err(|cause| content(cause.to_string()))?;
    let base = AreasStudy::new(config::load_scene(&file.scene)?);
    file.search(&base).map_err(content)
}

impl SearchFile {
    fn search(self, base: &AreasStudy) -> Result<SearchStudy, String> {
        if self.version != VERSION {
            return Err(format!("version must be {VERSION}, found {}", self.version));
        }
        if self.seeds.is_empty() {
            return Err("expected `seeds`, the list that every point sees, found none".to_owned());
        }
        let settings: Vec<_> = self.base.iter().map(|(key, value)| (key.as_str(), value)).collect();
        let search = SearchStudy {
            name: self.name,
            base: keys::set(base, &settings)?,
            knobs: self.knob.into_iter().map(KnobFile::checked).collect::<Result<_, _>>()?,
            one_at_a_time: self.one_at_a_time,
            joint: self.joint,
            seeds: self.seeds,
        };
        if search.points().saturating_mul(search.seeds.len()) > MOST_UNITS {
            return Err(format!("more than {MOST_UNITS} points × seeds; lower `joint`"));
        }
        // Every value of every knob must be one, tried alone; what does not go together shows in the search.
        for knob in &search.knobs {
            for value in &knob.values {
                keys::set(&search.base, &knob.set_to(value).collect::<Vec<_>>())?;
            }
        }
        Ok(search)
    }
}

impl KnobFile {
    fn checked(self) -> Result<Knob, String> {
        let keys: Vec<String> = self.key.into_iter().chain(self.keys).collect();
        let single = keys.len() == 1;
        let tuple = |value: Value| match value {
            Value::Array(items) if !single => items,
            value => vec![value],
        };
        let values: Vec<Vec<Value>> = self.values.into_iter().map(tuple).collect();
        let name = keys.join("`, `");
        if keys.is_empty() || values.is_empty() {
            return Err(format!(
                "a [[knob]] needs a `key`, or `keys` that go together, and `values`, found `{name}`"
            ));
        }
        if values.iter().any(|value| value.len() != keys.len()) {
            return Err(format!("knob `{name}`: expected every value to be a list with one entry a key"));
        }
        Ok(Knob { keys, values })
    }
}
