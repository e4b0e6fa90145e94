//! The estimators by name, and their numbers side by side with the truth.

use comfy_table::Cell;
use rowscan_canopy::estimator::{REPORTED, TABLE};
use rowscan_canopy::{EstimatorInfo, Quantity};
use rowscan_study::side_by_side::{Beside, estimators_named};

use super::Failure;
use super::grid::Grid;
use super::output::{self, number, percent};

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
        estimators_named(&self.estimators).map_err(|error| Failure::Usage(error.to_string()))
    }
}

/// The numbers as a table for people.
pub(super) fn table(rows: &[Beside]) -> String {
    let mut table = Grid::new();
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
