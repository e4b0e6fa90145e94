//! `rowscan study accuracy`: holds both estimators against rows of known leaf area.

use comfy_table::Cell;
use rowscan_canopy::TreeEstimate;
use serde::{Deserialize, Serialize};

use super::keep::KeepArgs;
use super::rows::{Rows, Seeds, tries};
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, percent, say, share};
use crate::cli::scene::RowSceneArgs;
use crate::cli::{Failure, Format, Outcome};
use rowscan_study::calibrations;
use rowscan_study::foliage::LaiRange;
use rowscan_study::notes;
use rowscan_study::trial::Trial;

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    #[command(flatten)]
    scene: RowSceneArgs,
    /// Seeds of the rows, first..last
    #[arg(long, value_name = "A..B", default_value = "1..20")]
    seeds: Seeds,
    /// Dress the rows to leaf area indices drawn from this range, low..high [default: as they grow]
    #[arg(long, value_name = "A..B")]
    lai: Option<LaiRange>,
    /// A calibration instead of the rig's own: a file, a shipped one's name, or a class (`spindle`), then that of the scanner's model
    #[arg(long, value_name = "NAME")]
    calibration: Option<String>,
    #[command(flatten)]
    keep: KeepArgs,
    /// How to write the table
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// One row of the accuracy table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct AccuracyRow {
    seed: u64,
    leaf_area_m2: f64,
    lai: Option<f64>,
    impacted_total_area_m2: Option<f64>,
    leaf_area_regression_m2: Option<f64>,
    regression_error: Option<f64>,
    leaf_area_contact_m2: Option<f64>,
    contact_error: Option<f64>,
    contact_raw_error: Option<f64>,
    null_error: Option<f64>,
    /// Why leaf areas are withheld, as a code; null where they are told.
    withheld: Option<String>,
    /// Codes of the estimate's warnings, with blanks between them.
    warnings: String,
}

impl From<&Trial> for AccuracyRow {
    fn from(trial: &Trial) -> Self {
        let (estimate, truth) = (&trial.estimate, trial.truth.leaf_area_m2);
        // Of nothing there is no share.
        let error = |found: Option<f64>| found.filter(|_| truth > 0.0).map(|found| (found - truth) / truth);
        Self {
            seed: trial.seed,
            leaf_area_m2: truth,
            lai: trial.truth.lai,
            impacted_total_area_m2: estimate.impacted_total_area_m2,
            leaf_area_regression_m2: estimate.leaf.areas.regression_m2().ok(),
            regression_error: error(estimate.leaf.areas.regression_m2().ok()),
            leaf_area_contact_m2: estimate.leaf.areas.contact_m2().ok(),
            contact_error: error(estimate.leaf.areas.contact_m2().ok()),
            contact_raw_error: error(estimate.leaf.areas.contact_raw_m2().ok()),
            null_error: error(estimate.leaf.null_m2),
            withheld: notes::withheld(estimate).map(str::to_owned),
            warnings: notes::warnings(estimate).join(" "),
        }
    }
}

/// Median and 90th percentile of the absolute relative error of each estimator.
#[derive(Debug, Serialize)]
struct AccuracySummary {
    estimator: &'static str,
    n: usize,
    median_abs_error: Option<f64>,
    p90_abs_error: Option<f64>,
}

impl AccuracySummary {
    fn new(estimator: &'static str, errors: impl Iterator<Item = Option<f64>>) -> Self {
        let mut errors: Vec<f64> = errors.flatten().map(f64::abs).collect();
        errors.sort_unstable_by(f64::total_cmp);
        // Nearest rank: an error some row really had.
        let rank = (0.9 * errors.len() as f64).ceil() as usize;
        let p90_abs_error = errors.get(rank.saturating_sub(1)).copied();
        Self { estimator, n: errors.len(), median_abs_error: rowscan_study::median(errors), p90_abs_error }
    }
}

/// What the tables are made of: a row and its trees.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct TriedRow {
    row: AccuracyRow,
    trees_by_regression: Vec<Option<f64>>,
    trees_by_contact: Vec<Option<f64>>,
}

impl From<&Trial> for TriedRow {
    fn from(trial: &Trial) -> Self {
        Self {
            row: trial.into(),
            trees_by_regression: tree_errors(trial, |tree| tree.leaf.areas.regression_m2().ok()),
            trees_by_contact: tree_errors(trial, |tree| tree.leaf.areas.contact_m2().ok()),
        }
    }
}

/// Relative errors tree by tree, against the leaf area within each tree's borders.
fn tree_errors(trial: &Trial, found: fn(&TreeEstimate) -> Option<f64>) -> Vec<Option<f64>> {
    let error = |tree: &TreeEstimate| {
        let real = trial.truth.tree(tree.tree)?;
        let truth = real.cell_leaf_area_m2.filter(|area| *area > 0.0)?;
        found(tree).map(|found| (found - truth) / truth)
    };
    trial.estimate.trees.iter().filter(|tree| tree.complete).map(error).collect()
}

#[derive(Debug, Serialize)]
struct Accuracy {
    scene: String,
    model: &'static str,
    rows: Vec<AccuracyRow>,
    summary: Vec<AccuracySummary>,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let scene = args.scene.scene()?;
    let rig = scene.resolved_rig();
    let model = args.scene.any_model(&rig, 0)?;
    let calibration = match (&args.calibration, &rig.calibration) {
        (Some(name), _) => Some(calibrations::load_named_calibration(name, model.name(), rig.optics)?),
        (None, Some(name)) => calibrations::load_calibration_for(name, model.name(), rig.optics)?,
        (None, None) => None,
    };
    if let Some(seed) =
        calibration.iter().flat_map(|c| &c.provenance.seeds).find(|seed| args.seeds.0.contains(seed))
    {
        say(format_args!(
            "warning: the calibration was fitted on seed {seed} too; choose seeds it has not seen"
        ));
    }
    let rows = Rows { seeds: args.seeds.0, lai: args.lai };
    let kept = args.keep.open()?;
    let take = |trial: &Trial| TriedRow::from(trial);
    let tried = tries(&scene, &rows, model, calibration, kept, "accuracy".to_owned(), take).await?;
    let rows: Vec<AccuracyRow> = tried.iter().map(|tried| tried.row.clone()).collect();
    let summary = vec![
        AccuracySummary::new("regression on I_T", rows.iter().map(|row| row.regression_error)),
        AccuracySummary::new("contact frequency", rows.iter().map(|row| row.contact_error)),
        AccuracySummary::new("contact frequency, raw", rows.iter().map(|row| row.contact_raw_error)),
        AccuracySummary::new("null (training mean)", rows.iter().map(|row| row.null_error)),
        AccuracySummary::new(
            "single trees: regression on I_T",
            tried.iter().flat_map(|row| row.trees_by_regression.iter().copied()),
        ),
        AccuracySummary::new(
            "single trees: contact frequency",
            tried.iter().flat_map(|row| row.trees_by_contact.iter().copied()),
        ),
    ];
    // Rows of which no leaf area is told say nothing of how accurate one is.
    let is_told = rows.iter().any(|row| row.withheld.is_none());
    match args.format {
        Format::Json | Format::Jsonl => {
            output::print_json(
                args.format,
                &Accuracy { scene: args.scene.name, model: model.name(), rows, summary },
            )?;
        }
        Format::Csv => output::print_rows(args.format, &rows)?,
        Format::Table => {
            output::print(&table(&rows))?;
            let mut grid = Grid::new();
            output::head(&mut grid, ["estimator", "n", "median |error|", "p90 |error|"]);
            for line in &summary {
                grid.add_row([
                    Cell::new(line.estimator),
                    number(Some(line.n as f64), 0),
                    share(line.median_abs_error),
                    share(line.p90_abs_error),
                ]);
            }
            output::print(&format!("{grid}\n"))?;
        }
    }
    Ok(if is_told { Outcome::Done } else { Outcome::Finding })
}

fn table(rows: &[AccuracyRow]) -> String {
    let mut grid = Grid::new();
    let notes = |row: &AccuracyRow| {
        let warnings: Vec<&str> = row.warnings.split_whitespace().collect();
        // A warning may have the same cause, and then it has the same code.
        let withheld = row.withheld.as_deref().filter(|why| !warnings.contains(why));
        withheld.into_iter().chain(warnings.iter().copied()).collect::<Vec<_>>().join(", ")
    };
    let is_noted = rows.iter().any(|row| !notes(row).is_empty());
    let heads = [
        "seed",
        "leaf area m²",
        "LAI",
        "I_T m²",
        "by I_T",
        "error",
        "by contact",
        "error",
        "raw error",
        "null error",
    ];
    output::head(&mut grid, heads.into_iter().chain(is_noted.then_some("warnings")));
    for row in rows {
        let cells = [
            Cell::new(row.seed),
            number(Some(row.leaf_area_m2), 2),
            number(row.lai, 2),
            number(row.impacted_total_area_m2, 3),
            number(row.leaf_area_regression_m2, 2),
            percent(row.regression_error),
            number(row.leaf_area_contact_m2, 2),
            percent(row.contact_error),
            percent(row.contact_raw_error),
            percent(row.null_error),
        ];
        grid.add_row(cells.into_iter().chain(is_noted.then(|| Cell::new(notes(row)))));
    }
    format!("{grid}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_and_nine_of_ten_are_below_an_error_that_some_row_had() {
        let summary = AccuracySummary::new("x", (1..=10).map(|n| Some(-f64::from(n))));
        assert_eq!((summary.median_abs_error, summary.p90_abs_error), (Some(5.5), Some(9.0)));
        assert_eq!(AccuracySummary::new("x", [None].into_iter()).median_abs_error, None);
    }
}
