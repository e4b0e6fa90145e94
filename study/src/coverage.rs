//! How often the intervals of the leaf area hold the truth, class by class, on rows that no calibration or table has seen.
//!
//! The calibration is the one that a user of the scene's rig gets. Seeds are hash("coverage", seed, row), so none is one of the transfer study's.

use rowscan_scenes::Scene;
use rowscan_scenes::parameters::SceneFile;
use serde::{Deserialize, Serialize};

use crate::archive::Depends;
use crate::calibrations;
use crate::classes::Classes;
use crate::notes::{ALWAYS, RowNotes};
use crate::wilson::wilson;
use crate::{Header, Nursery, Study, Unit, UnitError, fingerprint, rms};

/// Rows of every class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoverageStudy {
    /// The classes.
    pub classes: Classes,
    /// Rows a class.
    pub rows: usize,
}

/// One row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoverageRow {
    /// Its seed.
    pub seed: u64,
    /// True one-sided leaf area, m².
    pub truth_m2: f64,
    /// The estimate; null where it was withheld.
    pub leaf_area_m2: Option<f64>,
    /// Ends of the sampling error.
    pub sampling_m2: Option<[f64; 2]>,
    /// Ends of the interval.
    pub interval_m2: Option<[f64; 2]>,
    /// Codes of the estimate's warnings.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// A row without a warning is silently wrong where its error is above so much of the truth,
const SILENT_ERROR: f64 = 0.25;
/// or above so many half widths of its interval.
const SILENT_WIDTHS: f64 = 2.0;

impl CoverageRow {
    /// No warning, and far off.
    fn is_silently_wrong(&self) -> bool {
        let Some(leaf_m2) = self.leaf_area_m2 else { return false };
        let error_m2 = (leaf_m2 - self.truth_m2).abs();
        let beyond = |[low, high]: [f64; 2]| error_m2 > SILENT_WIDTHS * (high - low) / 2.0;
        let warned = self.warnings.iter().any(|code| !ALWAYS.contains(&code.as_str()));
        !warned && (error_m2 > SILENT_ERROR * self.truth_m2 || self.interval_m2.is_some_and(beyond))
    }
}

impl CoverageStudy {
    fn seed(&self, index: usize) -> u64 {
        fingerprint::seed(Self::NAME, self.classes.scene.seed, index % self.rows.max(1))
    }
}

impl Study for CoverageStudy {
    const NAME: &'static str = "coverage";
    type Result = CoverageRow;

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

    fn unit(&self, index: usize, nursery: &Nursery, notes: &mut RowNotes) -> Result<CoverageRow, UnitError> {
        let Some(class) = self.classes.classes.get(index / self.rows.max(1)) else {
            return Err(UnitError::Class { name: index.to_string(), why: "there is none".to_owned() });
        };
        let seed = self.seed(index);
        let trial = class.drive_past(nursery, &self.classes.files, seed, &[], calibrations::of_rig)?;
        notes.add(&trial.estimate);
        Ok(CoverageRow {
            seed,
            truth_m2: trial.truth.leaf_area_m2,
            leaf_area_m2: trial.estimate.leaf.areas.best_m2().ok(),
            sampling_m2: trial.estimate.leaf.sampling_error_m2,
            interval_m2: trial.estimate.leaf.interval_m2,
            warnings: trial.estimate.warnings.iter().map(|warning| warning.code().to_owned()).collect(),
        })
    }
}

/// What the study found.
#[derive(Clone, Debug, Serialize)]
pub struct CoverageReport {
    /// Version, seed, scene, settings.
    pub provenance: Header<CoverageStudy>,
    /// One row a class.
    pub rows: Vec<Covered>,
}

/// One class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Covered {
    /// The property.
    pub axis: String,
    /// The class.
    pub class: String,
    /// Rows with an estimate.
    pub n: usize,
    /// Rows whose estimate is withheld: they are in none of the numbers below.
    pub withheld: usize,
    /// Mean of estimate / truth − 1; none without an estimate.
    pub bias: Option<f64>,
    /// Root mean square of the same.
    pub rmse: Option<f64>,
    /// Share of rows whose sampling error holds the truth.
    pub sampling_holds: Option<Share>,
    /// Share of rows whose interval holds the truth.
    pub interval_holds: Option<Share>,
    /// Half of an interval's width over the estimate, mean.
    pub half_width: Option<f64>,
    /// Rows that are far off and bear no warning: an error above 25 %, or above twice half the interval's width.
    pub silent: usize,
}

/// A share with Wilson's 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// Held.
    pub share: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Sums a whole study up.
pub fn report(provenance: Header<CoverageStudy>, units: &[Unit<CoverageRow>]) -> CoverageReport {
    let (classes, rows) = (&provenance.settings.classes.classes, provenance.settings.rows);
    let row = |(number, class): (usize, &crate::classes::Class)| {
        let own: Vec<&CoverageRow> =
            units.iter().filter(|unit| unit.index / rows.max(1) == number).map(|unit| &unit.result).collect();
        let withheld = own.iter().filter(|row| row.leaf_area_m2.is_none()).count();
        // Where nothing is there an error has no share.
        let own: Vec<&CoverageRow> = own.into_iter().filter(|row| row.truth_m2 > 0.0).collect();
        let errors: Vec<f64> =
            own.iter().filter_map(|row| Some(row.leaf_area_m2? / row.truth_m2 - 1.0)).collect();
        let widths: Vec<f64> = own
            .iter()
            .filter_map(|row| {
                let [low, high] = row.interval_m2?;
                Some((high - low) / 2.0 / row.leaf_area_m2?)
            })
            .collect();
        Covered {
            axis: class.axis.clone(),
            class: class.name.clone(),
            n: errors.len(),
            withheld,
            bias: (!errors.is_empty()).then(|| mean(&errors)),
            rmse: (!errors.is_empty()).then(|| rms(&errors)),
            sampling_holds: share(&own, |row| row.sampling_m2),
            interval_holds: share(&own, |row| row.interval_m2),
            half_width: (!widths.is_empty()).then(|| mean(&widths)),
            silent: own.iter().filter(|row| row.is_silently_wrong()).count(),
        }
    };
    let rows = classes.iter().enumerate().map(row).collect();
    CoverageReport { provenance, rows }
}

fn share(rows: &[&CoverageRow], ends: impl Fn(&CoverageRow) -> Option<[f64; 2]>) -> Option<Share> {
    let held: Vec<bool> = rows
        .iter()
        .filter_map(|row| ends(row).map(|[low, high]| (low..=high).contains(&row.truth_m2)))
        .collect();
    let hits = held.iter().filter(|held| **held).count();
    let [low, high] = wilson(hits, held.len());
    (!held.is_empty()).then(|| Share { share: hits as f64 / held.len() as f64, low, high })
}

fn mean(values: &[f64]) -> f64 {
    rowscan_canopy::regression::mean(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(leaf_m2: f64, interval_m2: Option<[f64; 2]>, warnings: &[&str]) -> CoverageRow {
        let warnings = warnings.iter().map(|code| (*code).to_owned()).collect();
        CoverageRow {
            seed: 1,
            truth_m2: 10.0,
            leaf_area_m2: Some(leaf_m2),
            sampling_m2: None,
            interval_m2,
            warnings,
        }
    }

    #[test]
    fn a_row_that_is_far_off_is_silent_unless_it_warns_of_it() {
        assert!(row(13.0, None, &[]).is_silently_wrong(), "above 25 %");
        assert!(!row(12.0, None, &[]).is_silently_wrong());
        assert!(
            row(12.0, Some([11.5, 12.5]), &["remission_assumed"]).is_silently_wrong(),
            "four half widths"
        );
        assert!(!row(12.0, Some([10.8, 13.2]), &[]).is_silently_wrong(), "less than two");
        assert!(!row(30.0, Some([29.0, 31.0]), &["shares_disagree"]).is_silently_wrong());
        let withheld = CoverageRow { leaf_area_m2: None, ..row(0.0, None, &[]) };
        assert!(!withheld.is_silently_wrong(), "what is withheld is no number");
    }
}
