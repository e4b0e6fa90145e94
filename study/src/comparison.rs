//! Every estimator against the truth, over many rows: bias, spread, and what someone who does not scan would say.

use rayon::prelude::*;
use rowscan_canopy::estimator::{TABLE, by_name};
use rowscan_canopy::{Calibration, CutMethod, Measure, Pipeline, PipelineError, Quantity};
use rowscan_protocol::model::AnyModel;
use rowscan_scenes::Scene;
use serde::{Deserialize, Serialize};

use crate::appraisal::Appraisal;
use crate::archive::{Archive, Depends};
use crate::fine_scan::fine_scan;
use crate::moments;
use crate::notes::RowNotes;
use crate::reading::ReadingError;
use crate::trial::{Trial, TrialError};
use rowscan_emulator::stage::Stage;

/// What numbers are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scope {
    /// The whole row.
    Row,
    /// Single trees, cut at the spacing.
    Tree,
}

/// One estimator's quantity over all rows or trees.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    /// The scene.
    pub scene: String,
    /// Rows or trees.
    pub scope: Scope,
    /// The estimator.
    pub estimator: &'static str,
    /// The quantity.
    pub quantity: Quantity,
    /// Rows or trees with a value and a truth that is not zero. As all that follows, its numbers are of them.
    pub n: usize,
    /// Rows or trees with such a truth that the estimator gives no value for.
    pub without: usize,
    /// Mean of the truths.
    pub truth_mean: Option<f64>,
    /// Mean of value / truth − 1.
    pub bias: Option<f64>,
    /// Standard deviation of value / truth over its mean; from two on.
    pub cv: Option<f64>,
    /// The same of the mean of all *other* rows' truths, taken for each: the estimate of someone who does not scan.
    pub null_cv: Option<f64>,
    /// Share of the sampling errors at 95 % that hold the truth, where there is one: below 0.95 by what is not sampling.
    pub sampling_holds: Option<f64>,
}

/// How well trees are found in the data.
#[derive(Clone, Debug, Serialize)]
pub struct CutCompared {
    /// The scene.
    pub scene: String,
    /// How.
    pub method: CutMethod,
    /// Rows.
    pub rows: usize,
    /// Trees planted, a row.
    pub planted: f64,
    /// Mean of trees found − planted, a row.
    pub count_error: f64,
    /// Rows with as many trees found as planted.
    pub rows_right: usize,
    /// Mean distance from a found border to the nearest true one, metres.
    pub border_error_m: Option<f64>,
}

/// A row's numbers.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Row {
    pairs: Vec<(Scope, Measure, f64)>,
    cuts: Vec<(CutMethod, i64, Vec<f64>)>,
    planted: usize,
}

/// Tries a scene's rows of these seeds, and compares.
pub fn compare(
    scene: &Scene,
    seeds: &[u64],
    model: AnyModel,
    calibration: Option<&Calibration>,
    archive: &Archive,
    done: &(dyn Fn() + Sync),
) -> Result<(Vec<Compared>, Vec<CutCompared>), TrialError> {
    let rows: Vec<Row> = seeds
        .par_iter()
        .map(|&seed| {
            let scene = Scene { seed, ..scene.clone() };
            let depends = || Some(Depends::on_pass(&scene, model.name()).and("calibration", &calibration));
            let row = archive.row("estimators", depends, |notes| {
                Row::try_one(scene.clone(), model, calibration.cloned(), notes)
            });
            done();
            row
        })
        .collect::<Result<_, _>>()?;
    Ok((compared(&scene.name, &rows), cuts_compared(&scene.name, &rows)))
}

impl Row {
    fn try_one(
        scene: Scene,
        model: AnyModel,
        calibration: Option<Calibration>,
        notes: &mut RowNotes,
    ) -> Result<Self, TrialError> {
        let stage = Stage::grow(scene, &|_, _| {})?;
        let all: Vec<_> = TABLE.iter().collect();
        let trial = Trial::drive_past(&stage, model, calibration, &all)?;
        notes.add(&trial.estimate);
        let mount = stage.rig.scanners.first().cloned().unwrap_or_default();
        // It looks at the first row.
        let is_first = stage.row_seen(0).row == 0;
        let finer = if is_first { finer_scan(&stage).map_err(ReadingError::from)? } else { Vec::new() };
        let appraisal =
            Appraisal::of((&stage.orchard, stage.row_seen(0)), &mount, stage.rig.ground_clearance_m)
                .with_finer_scan(finer);
        let start_m = stage.rig.start_m;
        let whole = appraisal.stretch(start_m, start_m + trial.length_m);
        let mut pairs = Vec::new();
        for measure in trial.estimate.side_by_side() {
            let truth = whole.value(measure.quantity, measure.band_m());
            pairs.extend(truth.map(|truth| (Scope::Row, measure, truth)));
        }
        let spacing_m = stage.rig.tree_spacing_m.unwrap_or(1.0);
        for tree in trial.estimate.trees.iter().filter(|tree| tree.complete) {
            let cell = appraisal.stretch(tree.y_m - spacing_m / 2.0, tree.y_m + spacing_m / 2.0);
            for measure in tree.side_by_side() {
                let truth = cell.value(measure.quantity, measure.band_m());
                pairs.extend(truth.map(|truth| (Scope::Tree, measure, truth)));
            }
        }
        let standing = trial.truth.trees.iter().filter(|tree| tree.height_m > 0.0);
        let planted: Vec<f64> = standing.filter_map(|tree| tree.y_m).collect();
        let cuts = trial.estimate.trees_found.iter().map(|found| {
            // A border between two planted neighbours lies half way; at the row's ends it lies beyond what was scanned.
            let borders = found.trees.iter().skip(1).map(|tree| {
                let off = planted.iter().map(|y_m| (tree.y_from_m - (y_m - spacing_m / 2.0)).abs());
                off.fold(f64::INFINITY, f64::min)
            });
            let count = found.trees.len() as i64 - planted.len() as i64;
            (found.method, count, borders.filter(|off| off.is_finite()).collect())
        });
        Ok(Self { cuts: cuts.collect(), planted: planted.len(), pairs })
    }
}

/// Gaps, porosity and impacted area of the row by a scan so fine that a finer one changes nothing.
fn finer_scan(stage: &Stage) -> Result<Vec<Measure>, PipelineError> {
    let Some(mount) = stage.rig.scanners.first() else { return Ok(Vec::new()) };
    let wanted: Vec<_> = ["gap", "porosity", "impacted"].into_iter().filter_map(by_name).collect();
    let make = |rig: &_| Ok(Pipeline::new(Some(rig), 0, None)?.with_estimators(&wanted));
    Ok(fine_scan(stage, mount, make)?.measures)
}

fn compared(scene: &str, rows: &[Row]) -> Vec<Compared> {
    // In the order in which the first row lists them.
    let mut kinds: Vec<(Scope, &'static str, Quantity)> = Vec::new();
    for (scope, measure, _) in rows.iter().flat_map(|row| &row.pairs) {
        let kind = (*scope, measure.estimator, measure.quantity);
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    kinds
        .into_iter()
        .filter_map(|(scope, estimator, quantity)| {
            let of = |(own, m, _): &&(Scope, Measure, f64)| {
                *own == scope && m.estimator == estimator && m.quantity == quantity && m.band_m().is_none()
            };
            let pairs: Vec<_> = rows.iter().flat_map(|row| &row.pairs).filter(of).collect();
            let standing = || pairs.iter().filter(|(_, _, truth)| *truth > 0.0);
            let known: Vec<(f64, f64)> =
                standing().filter_map(|(_, measure, truth)| Some((measure.value?, *truth))).collect();
            let without = standing().count() - known.len();
            let ratios: Vec<f64> = known.iter().map(|(value, truth)| value / truth).collect();
            let (total, n) = (known.iter().map(|(_, truth)| truth).sum::<f64>(), known.len());
            let others = |truth: f64| (total - truth) / (n as f64 - 1.0);
            let null: Vec<f64> = known.iter().map(|(_, truth)| others(*truth) / truth).collect();
            let held = pairs.iter().filter_map(|(_, m, truth)| Some((m.low?..=m.high?).contains(truth)));
            let held: Vec<bool> = held.collect();
            (n + without > 0).then(|| Compared {
                scene: scene.to_owned(),
                scope,
                estimator,
                quantity,
                n,
                without,
                truth_mean: (n > 0).then(|| total / n as f64),
                bias: (n > 0).then(|| mean(&ratios) - 1.0),
                cv: cv(&ratios),
                null_cv: cv(&null),
                sampling_holds: (!held.is_empty())
                    .then(|| held.iter().filter(|held| **held).count() as f64 / held.len() as f64),
            })
        })
        .collect()
}

fn cuts_compared(scene: &str, rows: &[Row]) -> Vec<CutCompared> {
    let of = |method: CutMethod| {
        let cuts: Vec<_> = rows.iter().flat_map(|row| &row.cuts).filter(|cut| cut.0 == method).collect();
        let off: Vec<f64> = cuts.iter().flat_map(|cut| cut.2.iter().copied()).collect();
        CutCompared {
            scene: scene.to_owned(),
            method,
            rows: rows.len(),
            planted: mean(&rows.iter().map(|row| row.planted as f64).collect::<Vec<_>>()),
            count_error: mean(&cuts.iter().map(|cut| cut.1 as f64).collect::<Vec<_>>()),
            rows_right: cuts.iter().filter(|cut| cut.1 == 0).count(),
            border_error_m: (!off.is_empty()).then(|| mean(&off)),
        }
    };
    CutMethod::ALL.into_iter().map(of).collect()
}

fn mean(values: &[f64]) -> f64 {
    rowscan_canopy::regression::mean(values)
}

/// The standard deviation over the mean; one value alone has none.
fn cv(values: &[f64]) -> Option<f64> {
    let (mean, sd) = moments(values);
    sd.map(|sd| sd / mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_scenes::files;

    fn row(value: Option<f64>, truth: f64) -> Row {
        let measure = Measure::new("contact", Quantity::LeafArea, value);
        Row { pairs: vec![(Scope::Row, measure, truth)], cuts: Vec::new(), planted: 0 }
    }

    #[test]
    fn an_estimator_without_a_number_has_a_line_and_one_row_alone_has_no_scatter() {
        let none = compared("s", &[row(None, 4.0), row(None, 5.0)]);
        assert_eq!((none[0].n, none[0].without, none[0].bias, none[0].cv), (0, 2, None, None));
        let one = compared("s", &[row(Some(5.0), 4.0), row(None, 5.0), row(Some(1.0), 0.0)]);
        assert_eq!((one[0].n, one[0].without, one[0].truth_mean), (1, 1, Some(4.0)));
        assert_eq!((one[0].bias, one[0].cv, one[0].null_cv), (Some(0.25), None, None));
    }

    fn finer(scene: &str) -> Vec<Measure> {
        let stage =
            Stage::grow(files::load_scene(scene, |_| {}).expect("built in"), &|_, _| {}).expect("grown");
        finer_scan(&stage).expect("scanned")
    }

    fn of(measures: &[Measure], quantity: Quantity) -> impl Iterator<Item = &Measure> {
        measures.iter().filter(move |m| m.quantity == quantity)
    }

    #[test]
    fn a_checkered_wall_lets_half_of_the_beams_pass() {
        let porosity = of(&finer("checker"), Quantity::Porosity).find_map(|m| m.value).expect("a porosity");
        assert!((porosity - 0.5).abs() < 0.01, "{porosity}");
    }

    #[test]
    fn a_wall_lets_no_beam_pass_below_its_top_and_all_above() {
        // It stands in the row plane from 0.5 m to 3 m, and there a band of the plane is a band of the wall.
        let found = finer("wall");
        for band in of(&found, Quantity::GapFraction) {
            let [low_m, high_m] = band.band_m().expect("a band");
            let share = band.value.expect("a share");
            match (low_m, high_m) {
                (low_m, high_m) if low_m >= 0.5 && high_m <= 3.0 => assert!(share < 1e-3, "{band:?}"),
                (low_m, _) if low_m >= 3.0 => assert!(share > 0.999, "{band:?}"),
                _ => {}
            }
        }
    }
}
