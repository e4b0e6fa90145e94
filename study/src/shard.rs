//! Parts of a study: which units, in which file, and how parts become the whole.

use std::collections::BTreeMap;
use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::{Study, Unit, fingerprint};

/// One of several equal parts of a study: every `of`-th unit. Written `i/n`, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    index: usize,
    of: usize,
}

/// Text that names no shard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected a shard as I/N with I from 1 to N, such as 2/4, found `{0}`")]
pub struct ShardError(String);

impl Shard {
    /// All of a study.
    pub const WHOLE: Self = Self { index: 1, of: 1 };

    /// Its units, of `units` in all.
    pub fn units(self, units: usize) -> impl Iterator<Item = usize> {
        Range { start: self.index - 1, end: units }.step_by(self.of)
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let parse = || {
            let (index, of) = text.split_once('/')?;
            let (index, of) = (index.parse().ok()?, of.parse().ok()?);
            (1..=of).contains(&index).then_some(Self { index, of })
        };
        parse().ok_or_else(|| ShardError(text.to_owned()))
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

/// Where results come from: in every file and report of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header<S> {
    /// The study's name.
    pub study: String,
    /// Version of this program.
    pub rowscan: String,
    /// The study's seed; every unit's own follows from it.
    pub seed: u64,
    /// The scene's name.
    pub scene: String,
    /// Fingerprint of the scene.
    pub scene_hash: String,
    /// Fingerprints of the files that its scenes name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub files: BTreeMap<String, String>,
    /// Fingerprint of what up to 512 of its units depend on: calibrations by their content, too.
    #[serde(default)]
    pub depends: String,
    /// Units of the whole study.
    pub units: usize,
    /// Everything the results depend on.
    pub settings: S,
}

impl<S: Study> Header<S> {
    /// Of a study run by this program.
    pub fn of(study: &S) -> Self {
        let scene = study.scene();
        Self {
            study: S::NAME.to_owned(),
            rowscan: env!("CARGO_PKG_VERSION").to_owned(),
            seed: scene.seed,
            scene: scene.name.clone(),
            scene_hash: fingerprint::of(scene),
            files: study
                .files()
                .into_iter()
                .map(|file| {
                    (file.path().to_owned(), fingerprint::of_content(file.bytes().unwrap_or_default()))
                })
                .collect(),
            depends: depends(study),
            units: study.units(),
            settings: study.clone(),
        }
    }

    /// The first thing in which two differ: results of both cannot stand together then.
    pub fn difference(&self, other: &Self) -> Option<&'static str> {
        [
            ("names", self.study == other.study),
            ("rowscan versions", self.rowscan == other.rowscan),
            ("seeds", self.seed == other.seed),
            ("scenes", self.scene_hash == other.scene_hash),
            ("files", self.files == other.files),
            // By what is written of them: settings that were read back do not hold the files.
            ("settings", fingerprint::of(&self.settings) == fingerprint::of(&other.settings)),
            ("numbers of orchards", self.units == other.units),
            // Scene, files and settings name calibrations, and do not hold them.
            ("calibrations", self.depends == other.depends),
        ]
        .into_iter()
        .find(|(_, same)| !same)
        .map(|(key, _)| key)
    }
}

/// Units of which a header holds what they depend on: units of one calibration lie side by side.
const DEPENDS_UNITS: usize = 512;

fn depends<S: Study>(study: &S) -> String {
    let units = study.units();
    let step = units.div_ceil(DEPENDS_UNITS).max(1);
    let lines = (0..units).step_by(step).map(|index| study.depends(index).map(|depends| depends.to_line()));
    fingerprint::of(&lines.collect::<Vec<_>>())
}

/// A finished shard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    deny_unknown_fields,
    bound(deserialize = "S: serde::de::DeserializeOwned, R: serde::de::DeserializeOwned")
)]
pub struct ShardFile<S, R> {
    /// Of which study.
    pub header: Header<S>,
    /// Which part.
    pub shard: Shard,
    /// Its units, in order.
    pub units: Vec<Unit<R>>,
}

/// Why shards do not make a whole.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MergeError {
    /// Nothing to merge.
    #[error("no shard files were given")]
    None,
    /// Shards of two studies.
    #[error(
        "{other} is a shard of another study than {first}: their {key} differ; merge shards of one command line only"
    )]
    Another {
        /// The first file.
        first: String,
        /// The one that does not fit.
        other: String,
        /// What differs.
        key: &'static str,
    },
    /// A unit twice.
    #[error("orchard {index} is in {first} and again in {other}; give every shard once")]
    Twice {
        /// Which, from 0.
        index: usize,
        /// One file.
        first: String,
        /// The other.
        other: String,
    },
    /// Units in no file.
    #[error(
        "{missing} of {units} orchards are in none of the files, the first is orchard {first}; give all shards"
    )]
    Missing {
        /// How many.
        missing: usize,
        /// How many there are.
        units: usize,
        /// The first, from 0.
        first: usize,
    },
}

/// A whole study: where its results come from, and all its units in order.
pub type Whole<S> = (Header<S>, Vec<Unit<<S as Study>::Result>>);

/// Joins named shards into the whole study.
pub fn merge<S: Study>(files: Vec<(String, ShardFile<S, S::Result>)>) -> Result<Whole<S>, MergeError> {
    let Some((first, header)) = files.first().map(|(name, file)| (name.clone(), file.header.clone())) else {
        return Err(MergeError::None);
    };
    let mut units: Vec<Unit<S::Result>> = Vec::new();
    let mut places: BTreeMap<usize, String> = BTreeMap::new();
    for (other, file) in files {
        if let Some(key) = header.difference(&file.header) {
            return Err(MergeError::Another { first, other, key });
        }
        for unit in file.units {
            let index = unit.index;
            if let Some(first) = places.insert(index, other.clone()) {
                return Err(MergeError::Twice { index, first, other });
            }
            units.push(unit);
        }
    }
    let missing: Vec<usize> = (0..header.units).filter(|index| !places.contains_key(index)).collect();
    if let Some(first) = missing.first() {
        return Err(MergeError::Missing { missing: missing.len(), units: header.units, first: *first });
    }
    units.sort_by_cached_key(|unit| unit.index);
    Ok((header, units))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_out_every_unit_once() {
        for of in 1..6 {
            let mut all: Vec<usize> = (1..=of).flat_map(|index| Shard { index, of }.units(20)).collect();
            all.sort_unstable();
            assert_eq!(all, (0..20).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_shard_is_one_of_its_number() {
        assert_eq!("2/4".parse(), Ok(Shard { index: 2, of: 4 }));
        for text in ["5/4", "0/4", "0/0", "1", "a/b", "-1/2", "1/"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
