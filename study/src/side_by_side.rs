//! The row's numbers by several estimators, each beside the truth: what `--estimators` adds to an estimate.

use rowscan_canopy::estimator::{TABLE, by_name};
use rowscan_canopy::{Estimate, EstimatorInfo, Measure};
use rowscan_emulator::stage::Stage;
use rowscan_protocol::rig::Rig;
use rowscan_scenes::files;
use serde::Serialize;

use crate::appraisal::{Appraisal, Stretch};

/// A name that is no estimator.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no estimator `{found}`{nearest}; there are all, {known}")]
pub struct UnknownEstimator {
    /// The name.
    found: String,
    /// What may have been meant.
    nearest: String,
    /// Those there are.
    known: String,
}

/// The estimators of these names, in the order of the table; `all` is every one.
///
/// # Errors
/// A name that is none.
pub fn estimators_named(names: &[String]) -> Result<Vec<&'static EstimatorInfo>, UnknownEstimator> {
    if names.iter().any(|name| name == "all") {
        return Ok(TABLE.iter().collect());
    }
    if let Some(unknown) = names.iter().find(|name| by_name(name).is_none()) {
        let known: Vec<&str> = TABLE.iter().map(|info| info.name).collect();
        return Err(UnknownEstimator {
            nearest: files::nearest(unknown, &known),
            known: known.join(", "),
            found: unknown.clone(),
        });
    }
    Ok(TABLE.iter().filter(|info| names.iter().any(|name| name == info.name)).collect())
}

/// A number beside what it should have been.
#[derive(Clone, Debug, Serialize)]
pub struct Beside {
    /// The number.
    #[serde(flatten)]
    pub measure: Measure,
    /// What is really there, by the same definition; null where the scene is unknown or only a finer scan could tell.
    pub truth: Option<f64>,
    /// (value − truth) / truth.
    pub error: Option<f64>,
}

/// The row's numbers as the scanner of that number in the rig gave them, each with its truth where the orchard is known.
pub fn beside_truth(estimate: &Estimate, scanner: usize, truth: Option<(&Stage, &Rig)>) -> Vec<Beside> {
    let appraisal = truth.map(|(stage, rig)| {
        let mount = rig.scanners.get(scanner).cloned().unwrap_or_default();
        let seen = (&*stage.orchard, stage.row_seen(scanner));
        (Appraisal::of(seen, &mount, rig.ground_clearance_m), rig.first_line_m(scanner))
    });
    let stretch = appraisal.as_ref().map(|(truth, start_m)| scanned(truth, estimate, *start_m));
    Beside::of_row(estimate, stretch.as_ref())
}

impl Beside {
    /// The row's numbers, each with its truth where the scene is known.
    fn of_row(estimate: &Estimate, truth: Option<&Stretch<'_>>) -> Vec<Self> {
        estimate.side_by_side().into_iter().map(|measure| Self::new(measure, truth)).collect()
    }

    fn new(measure: Measure, truth: Option<&Stretch<'_>>) -> Self {
        let truth = truth.and_then(|stretch| stretch.value(measure.quantity, measure.band_m()));
        let error = measure.value.zip(truth).map(|(value, truth)| (value - truth) / truth);
        Self { measure, truth, error: error.filter(|error| error.is_finite()) }
    }
}

/// The piece of the row that an estimate is of, whose first line lies at `start_m` of the row.
fn scanned<'a>(appraisal: &'a Appraisal, estimate: &Estimate, start_m: f64) -> Stretch<'a> {
    appraisal.stretch(start_m, start_m + estimate.scanned_m.unwrap_or(0.0))
}
