//! Calibrations carried from one class to another: every estimator fitted on one class and tried on the others, with the null beside it.
//!
//! The rows of a class are split by half: fits see the first, errors are told of the second, so that the diagonal is no fit to itself. Rows of
//! the same number have the same seed in every class, so that classes differ by their settings and not by their trees.

mod fits;
mod report;

use rowscan_canopy::estimator::by_name;
use rowscan_canopy::{CanopyClass, Estimate, EstimatorInfo, Quantity};
use rowscan_scenes::Scene;
use rowscan_scenes::parameters::SceneFile;
use serde::{Deserialize, Serialize};

pub use report::{BetweenRow, Carried, LeftOut, TransferReport, report};

use crate::archive::Depends;
use crate::classes::Classes;
use crate::notes::RowNotes;
use crate::{Nursery, Study, UnitError, fingerprint};

/// Rows of every class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransferStudy {
    /// The classes.
    pub classes: Classes,
    /// Rows a class, half of them to fit on.
    pub rows: usize,
}

/// One row: what the estimators regress on, and what is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TransferRow {
    /// Its seed.
    pub seed: u64,
    /// True one-sided leaf area, m².
    pub truth_m2: f64,
    /// Metres of row with canopy.
    pub canopy_m: f64,
    /// I_T, m².
    pub impacted_m2: f64,
    /// Leaf area by contact frequency, `voxel`, `polar` and `gap`, without calibration, m²; in the order of [`DENSITIES`].
    pub densities_m2: [Option<f64>; 4],
    /// Its leaves and wood.
    pub canopy: CanopyClass,
    /// From the scanner to the row plane, as the estimator is told, metres.
    pub distance_m: Option<f64>,
    /// Of the mirror, as the estimator is told, metres; unknown in journals of versions before it.
    #[serde(default)]
    pub height_m: Option<f64>,
    /// Between lines, metres; unknown in journals of versions before it.
    #[serde(default)]
    pub line_spacing_m: Option<f64>,
    /// How deep its crowns are seen, metres; unknown in journals of versions before it.
    #[serde(default)]
    pub crown_depth_m: Option<f64>,
}

/// The estimators that are a density times a volume: one factor calibrates them.
pub const DENSITIES: [&str; 4] = ["contact", "voxel", "polar", "gap"];

impl TransferStudy {
    fn seed(&self, index: usize) -> u64 {
        fingerprint::seed(Self::NAME, self.classes.scene.seed, index % self.rows.max(1))
    }
}

impl Study for TransferStudy {
    const NAME: &'static str = "transfer";
    type Result = TransferRow;

    fn units(&self) -> usize {
        self.classes.classes.len() * self.rows
    }

    fn scene(&self) -> &Scene {
        &self.classes.scene
    }

    fn files(&self) -> Vec<SceneFile> {
        self.classes.files.files()
    }

    fn effort(&self, _index: usize) -> f64 {
        1.0
    }

    fn depends(&self, index: usize) -> Option<Depends> {
        let class = self.classes.classes.get(index / self.rows.max(1))?;
        class.depends(&self.classes.files, self.seed(index))
    }

    fn grown(&self, index: usize) -> Option<Scene> {
        let class = self.classes.classes.get(index / self.rows.max(1))?;
        class.scene_of(&self.classes.files, self.seed(index)).ok()
    }

    fn unit(&self, index: usize, nursery: &Nursery, notes: &mut RowNotes) -> Result<TransferRow, UnitError> {
        let Some(class) = self.classes.classes.get(index / self.rows.max(1)) else {
            return Err(UnitError::Class { name: index.to_string(), why: "there is none".to_owned() });
        };
        let seed = self.seed(index);
        let asked: Vec<&'static EstimatorInfo> = DENSITIES.into_iter().filter_map(by_name).collect();
        let trial = class.drive_past(nursery, &self.classes.files, seed, &asked, |_| Ok(None))?;
        let estimate = &trial.estimate;
        notes.add(estimate);
        Ok(TransferRow {
            seed,
            truth_m2: trial.truth.leaf_area_m2,
            canopy_m: estimate.canopy_m.unwrap_or(0.0),
            impacted_m2: estimate.impacted_total_area_m2.unwrap_or(0.0),
            densities_m2: DENSITIES.map(|name| raw(estimate, name)),
            canopy: trial.class.canopy,
            distance_m: estimate.mount.map(|mount| mount.distance_m),
            height_m: estimate.mount.map(|mount| mount.height_m),
            line_spacing_m: estimate.contact.and_then(|contact| contact.line_spacing_m),
            crown_depth_m: estimate.crown_depth_m,
        })
    }
}

/// What a density says without calibration.
fn raw(estimate: &Estimate, name: &str) -> Option<f64> {
    if name == "contact" {
        return estimate.leaf.areas.contact_raw_m2().ok();
    }
    let of = |m: &&rowscan_canopy::Measure| {
        m.estimator == name && m.quantity == Quantity::LeafArea && m.band_m().is_none()
    };
    estimate.measures.iter().find(of)?.value
}
