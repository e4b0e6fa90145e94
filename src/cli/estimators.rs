//! The estimators by name, and their numbers side by side with the truth.

use comfy_table::Cell;
use rowscan_canopy::estimator::{REPORTED, TABLE, by_name};
use rowscan_canopy::{Estimate, EstimatorInfo, Measure, Quantity};
use rowscan_scenes::files;
use serde::Serialize;

use super::Failure;
use super::output::{self, number, percent};
use rowscan_study::appraisal::{Appraisal, Stretch};

/// Which estimators measure besides.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct EstimatorArgs {
    /// Measure by these estimators as well: `all`, or some of them by name; a name that is none lists them
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    estimators: Vec<String>,
}

impl EstimatorArgs {
    /// Whether any is.
    pub(super) fn are_asked(&self) -> bool {
        !self.estimators.is_empty()
    }

    /// The estimators asked for, in the order of the table.
    pub(super) fn asked(&self) -> Result<Vec<&'static EstimatorInfo>, Failure> {
        if self.estimators.iter().any(|name| name == "all") {
            return Ok(TABLE.iter().collect());
        }
        if let Some(unknown) = self.estimators.iter().find(|name| by_name(name).is_none()) {
            let names: Vec<&str> = TABLE.iter().map(|info| info.name).collect();
            let nearest = files::nearest(unknown, &names);
            return Err(Failure::Usage(format!(
                "there is no estimator `{unknown}`{nearest}; there are all, {}",
                names.join(", ")
            )));
        }
        Ok(TABLE.iter().filter(|info| self.estimators.iter().any(|name| name == info.name)).collect())
    }
}

/// A number beside what it should have been.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Beside {
    #[serde(flatten)]
    pub(super) measure: Measure,
    /// What is really there, by the same definition; null where the scene is unknown or only a finer scan could tell.
    pub(super) truth: Option<f64>,
    /// (value − truth) / truth.
    pub(super) error: Option<f64>,
}

impl Beside {
    /// The row's numbers, each with its truth where the scene is known.
    pub(super) fn of_row(estimate: &Estimate, truth: Option<&Stretch<'_>>) -> Vec<Self> {
        estimate.side_by_side().into_iter().map(|measure| Self::new(measure, truth)).collect()
    }

    fn new(measure: Measure, truth: Option<&Stretch<'_>>) -> Self {
        let truth = truth.and_then(|stretch| stretch.value(measure.quantity, measure.band_m()));
        let error = measure.value.zip(truth).map(|(value, truth)| (value - truth) / truth);
        Self { measure, truth, error: error.filter(|error| error.is_finite()) }
    }
}

/// The piece of the row an estimate is of.
pub(super) fn scanned<'a>(appraisal: &'a Appraisal, estimate: &Estimate, start_m: f64) -> Stretch<'a> {
    appraisal.stretch(start_m, start_m + estimate.scanned_m.unwrap_or(0.0))
}

/// The numbers as a table for people.
pub(super) fn table(rows: &[Beside]) -> String {
    let mut table = output::grid();
    output::head(
        &mut table,
        ["estimator", "quantity", "z m", "value", "sampling from", "to", "truth", "error"],
    );
    for Beside { measure, truth, error } in rows {
        let decimals =
            if measure.quantity == Quantity::TreeRowVolume || measure.quantity == Quantity::LeafWallArea {
                0
            } else {
                3
            };
        let band = measure.band_m().map_or_else(String::new, |[from, to]| format!("{from:.1} to {to:.1}"));
        table.add_row([
            Cell::new(measure.estimator),
            Cell::new(measure.quantity.key()),
            Cell::new(band),
            number(measure.value, decimals),
            number(measure.low, decimals),
            number(measure.high, decimals),
            number(*truth, decimals),
            percent(*error),
        ]);
    }
    format!("{table}\n")
}

/// What the estimators are, for the end of a help text.
pub(super) fn list() -> String {
    let mut text = String::from("Estimators (--estimators):\n");
    for info in TABLE {
        text.push_str(&format!("  {:<11}{}\n", info.name, info.title));
    }
    text.push_str("In every estimate:\n");
    for (name, title) in REPORTED {
        text.push_str(&format!("  {name:<11}{title}\n"));
    }
    text
}
