//! Studies: many orchards, one result each, one report over all.
//!
//! A [`Study`] is a set of settings that says how many units (orchards) it has and what one gives. [`run`] works through a
//! [`Shard`] of them on all cores; a [`journal`] keeps every finished unit, so that an interrupted run goes on where it was; a
//! [`ShardFile`] holds a finished shard, and [`merge`] joins shards; an [`Archive`] has the results of other studies' units. The report is made from the merged units alone, so that its
//! numbers are the same however the work was cut. Seeds follow from (study, seed, unit) and from nothing else.

pub mod appraisal;
pub mod archive;
pub mod areas;
pub mod budget;
pub mod calibrations;
mod cells_along;
pub mod class;
pub mod classes;
pub mod clumping;
pub mod comparison;
mod complaint;
pub mod coverage;
mod document;
pub mod eye;
pub mod field;
pub mod figure;
mod fine_scan;
pub mod fingerprint;
pub mod foliage;
pub mod height_truth;
pub mod journal;
mod name;
pub mod notes;
mod nursery;
pub mod physics;
pub mod pieces;
pub mod profile_beside;
pub mod reading;
#[cfg(test)]
mod reading_witness;
pub mod recorded;
pub mod resolution;
pub mod row_scan;
pub mod search;
mod settings;
mod shard;
pub mod side_by_side;
pub mod sides;
pub mod spraying;
pub mod sweep;
pub mod transfer;
pub mod trial;
mod wilson;

use notes::RowNotes;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use archive::{Archive, Depends};
pub use nursery::Nursery;
use rayon::prelude::*;
use rowscan_scenes::Scene;
use rowscan_scenes::parameters::SceneFile;
use rowscan_scenes::scan::ScanSettings;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

pub use document::StudyFileError;
pub use settings::{Setting, SettingError, scene_with};
pub use shard::{Header, MergeError, Shard, ShardError, ShardFile, Whole, merge};

/// A study: its settings are all that its results depend on.
pub trait Study: Clone + PartialEq + Serialize + DeserializeOwned + Sync {
    /// Its name on the command line and in files.
    const NAME: &'static str;
    /// What one unit gives.
    type Result: Clone + PartialEq + Serialize + DeserializeOwned + Send + Sync;

    /// How many units there are.
    fn units(&self) -> usize;

    /// The scene its orchards come from, and the seed.
    fn scene(&self) -> &Scene;

    /// The files that its scenes name.
    fn files(&self) -> Vec<SceneFile> {
        self.scene().clone().files_mut().into_iter().map(|file| file.clone()).collect()
    }

    /// How long a unit takes, in any measure: what makes the remaining time honest where units differ.
    fn effort(&self, index: usize) -> f64;

    /// All that one unit depends on, by which a kept result is found again: the same for units of two studies that are the same orchard under the same
    /// settings. None where it cannot be told; such a unit is never kept.
    fn depends(&self, index: usize) -> Option<Depends>;

    /// The scene that a unit grows, where other units may grow the same trees: those are done one after another, and grown once.
    fn grown(&self, _index: usize) -> Option<Scene> {
        None
    }

    /// Does one unit, on trees from the nursery where [`grown`](Self::grown) names them, and notes what its estimates say of themselves.
    fn unit(&self, index: usize, nursery: &Nursery, notes: &mut RowNotes) -> Result<Self::Result, UnitError>;
}

/// A unit with its result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unit<R> {
    /// Number of the unit, from 0.
    pub index: usize,
    /// What it gave.
    pub result: R,
}

/// Why a unit gave no result.
#[derive(Debug, thiserror::Error)]
pub enum UnitError {
    /// The orchard did not grow.
    #[error(transparent)]
    Grow(#[from] rowscan_scenes::GrowError),
    /// The scan could not be laid out.
    #[error(transparent)]
    Scan(#[from] rowscan_scenes::scan::ScanError),
    /// The wood test cannot be.
    #[error(transparent)]
    Mesh(#[from] rowscan_scenes::scan::MeshError),
    /// No beam met a leaf or a branch.
    #[error("the {kind} scan sees nothing: no beam met a leaf or a branch")]
    SeesNothing {
        /// The type of scan.
        kind: rowscan_scenes::scan::ScanKind,
    },
    /// The row is too short for its coarsest advance.
    #[error("a row of {length_m} m is too short for the coarsest advance: expected {needed_m} m at least")]
    TooShort {
        /// Metres of row.
        length_m: f64,
        /// Metres needed.
        needed_m: f64,
    },
    /// A sprayer that does not fit the rig, or a scan that gave none.
    #[error(transparent)]
    Spraying(#[from] spraying::SprayingError),
    /// A scanner model that is none.
    #[error("unknown scanner model `{found}`; see `rowscan models`")]
    UnknownModel {
        /// What was asked for.
        found: String,
    },
    /// A class whose scene cannot be used.
    #[error("class `{name}`: {why}")]
    Class {
        /// Its name.
        name: String,
        /// Why.
        why: String,
    },
    /// The calibration that the rig names cannot be read.
    #[error(transparent)]
    Calibration(#[from] crate::calibrations::ConfigError),
    /// The row could not be driven past by the emulated scanner.
    #[error(transparent)]
    Trial(#[from] crate::trial::TrialError),
}

/// Why a shard did not finish.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A unit failed.
    #[error("orchard {index}: {cause}")]
    Unit {
        /// Which, from 0.
        index: usize,
        /// Why.
        cause: UnitError,
    },
    /// A result could not be kept.
    #[error("cannot keep the result of orchard {index}: {cause}; make room and go on with --resume")]
    Keep {
        /// Which, from 0.
        index: usize,
        /// What the system said.
        cause: std::io::Error,
    },
}

/// The paper's lateral scan from where the scene's first scanner sits.
fn lateral_of(scene: &Scene) -> ScanSettings {
    let settings = ScanSettings::default();
    match scene.resolved_rig().scanners.first() {
        Some(mount) => ScanSettings { distance_m: mount.distance_m, height_m: mount.height_m, ..settings },
        None => settings,
    }
}

/// Mean, and standard deviation of two values and more.
pub(crate) fn moments(values: &[f64]) -> (f64, Option<f64>) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt()))
}

/// Root mean square.
pub(crate) fn rms(values: &[f64]) -> f64 {
    rowscan_canopy::regression::mean(&values.iter().map(|value| value * value).collect::<Vec<_>>()).sqrt()
}

/// The middle value, or the mean of the two in the middle; None of nothing.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = *values.get((values.len() - 1) / 2)?;
    Some((lower + upper) / 2.0)
}

/// Works through the units of `shard` that neither `done` nor the archive holds, on all cores, and gives all of them in order.
///
/// `keep` hears of every unit as soon as it is there (from several threads); its first failure ends the run.
pub fn run<S: Study>(
    study: &S,
    shard: Shard,
    done: Vec<Unit<S::Result>>,
    archive: &Archive,
    keep: &(dyn Fn(&Unit<S::Result>) -> std::io::Result<()> + Sync),
) -> Result<Vec<Unit<S::Result>>, RunError> {
    let mut open: Vec<usize> =
        shard.units(study.units()).filter(|index| done.iter().all(|unit| unit.index != *index)).collect();
    let copies = take_copies(study, &mut open, &done);
    // The long ones first, so that no core waits for one at the end; and those of the same trees together.
    open.sort_by_cached_key(|index| study.grown(*index).map(|scene| nursery::key(&scene)));
    open.sort_by(|a, b| study.effort(*b).total_cmp(&study.effort(*a)));
    let nursery = Nursery::default();
    let units = Mutex::new(done);
    on_all_cores(&open, &|index| {
        let result = archive
            .row(S::NAME, || study.depends(index), |notes| study.unit(index, &nursery, notes))
            .map_err(|cause| RunError::Unit { index, cause })?;
        let unit = Unit { index, result };
        keep(&unit).map_err(|cause| RunError::Keep { index, cause })?;
        units.lock().unwrap_or_else(PoisonError::into_inner).push(unit);
        Ok(())
    })?;
    let mut units = units.into_inner().unwrap_or_else(PoisonError::into_inner);
    for (index, of) in copies {
        let Some(result) = units.iter().find(|unit| unit.index == of).map(|unit| unit.result.clone()) else {
            continue;
        };
        let unit = Unit { index, result };
        keep(&unit).map_err(|cause| RunError::Keep { index, cause })?;
        units.push(unit);
    }
    // Cached, what is sorted is numbers, whatever the study.
    units.sort_by_cached_key(|unit| unit.index);
    Ok(units)
}

/// Takes out of `open` what depends on the very same as another unit there or in `done`, such as classes of two axes that are both the scene itself: the unit,
/// and the one whose result is its own.
fn take_copies<S: Study>(study: &S, open: &mut Vec<usize>, done: &[Unit<S::Result>]) -> Vec<(usize, usize)> {
    let key = |index: usize| study.depends(index).map(|depends| depends.to_line());
    let mut firsts: BTreeMap<String, usize> =
        done.iter().filter_map(|unit| Some((key(unit.index)?, unit.index))).collect();
    let mut copies = Vec::new();
    open.retain(|index| {
        let Some(key) = key(*index) else { return true };
        let first = *firsts.entry(key).or_insert(*index);
        if first != *index {
            copies.push((*index, first));
        }
        first == *index
    });
    copies
}

/// Compiled once for all studies.
fn on_all_cores(
    open: &[usize],
    work: &(dyn Fn(usize) -> Result<(), RunError> + Sync),
) -> Result<(), RunError> {
    open.par_iter().with_max_len(1).try_for_each(|index| work(*index))
}
