//! `rowscan study estimators`: every estimator against the truth, on rows of many seeds.

use std::sync::Arc;

use comfy_table::Cell;
use serde::Serialize;

use super::keep::KeepArgs;
use super::rows::{Seeds, named};
use crate::cli::blocking::off_runtime;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, percent, share};
use crate::cli::scene::OpticsArgs;
use crate::cli::{Failure, Format, Outcome, models, progress};
use rowscan_study::calibrations;
use rowscan_study::comparison::{Compared, CutCompared, Scope, compare};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// Scene files, or names of built-in scenes
    #[arg(value_name = "SCENE", default_values_t = ["spindle", "mature", "paper"].map(String::from))]
    scenes: Vec<String>,
    /// Seeds of the rows, first..last
    #[arg(long, value_name = "A..B", default_value = "1..20")]
    seeds: Seeds,
    /// Scanner model, instead of the rig's own
    #[arg(long, value_name = "NAME", value_parser = models::name(), hide_possible_values = true)]
    model: Option<String>,
    #[command(flatten)]
    optics: OpticsArgs,
    /// Write the tables as docs/estimators.md holds them
    #[arg(long, conflicts_with = "format")]
    markdown: bool,
    #[command(flatten)]
    keep: KeepArgs,
    /// How to write the tables; CSV holds the estimators only
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

#[derive(Debug, Default, Serialize)]
struct Comparison {
    estimators: Vec<Compared>,
    cuts: Vec<CutCompared>,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let mut comparison = Comparison::default();
    let kept = Arc::new(args.keep.open()?);
    for name in &args.scenes {
        let scene = named(args.optics.load(name)?, name);
        let rig = scene.resolved_rig();
        let mounted = rig.scanners.first().map(|mount| mount.model.as_str());
        let model = models::find(args.model.as_deref().or(mounted).unwrap_or_default())?;
        let calibration = match &rig.calibration {
            Some(name) => calibrations::load_calibration_for(name, model.name(), rig.optics)?,
            None => None,
        };
        let seeds = args.seeds.0.clone();
        let bar = progress::bar("comparing", "rows", seeds.len() as u64);
        let rows = Arc::clone(&kept);
        let work = move || {
            let compared =
                compare(&scene, &seeds, model, calibration.as_ref(), &rows.archive, &|| bar.inc(1));
            bar.finish_and_clear();
            compared
        };
        let (estimators, cuts) = off_runtime("compare the estimators", work).await?;
        comparison.estimators.extend(estimators);
        comparison.cuts.extend(cuts);
    }
    kept.tell();
    match args.format {
        _ if args.markdown => output::print(&markdown(&comparison))?,
        Format::Json | Format::Jsonl => output::print_json(args.format, &comparison)?,
        Format::Csv => output::print_rows(args.format, &comparison.estimators)?,
        Format::Table => output::print(&tables(&comparison))?,
    }
    Ok(Outcome::Done)
}

fn scope(scope: Scope) -> &'static str {
    match scope {
        Scope::Row => "row",
        Scope::Tree => "tree",
    }
}

fn tables(comparison: &Comparison) -> String {
    let mut estimators = Grid::new();
    output::head(
        &mut estimators,
        [
            "scene",
            "of",
            "estimator",
            "quantity",
            "n",
            "without",
            "truth",
            "bias",
            "CV",
            "null CV",
            "sampling holds",
        ],
    );
    for row in &comparison.estimators {
        estimators.add_row([
            Cell::new(&row.scene),
            Cell::new(scope(row.scope)),
            Cell::new(row.estimator),
            Cell::new(row.quantity.key()),
            number(Some(row.n as f64), 0),
            number(Some(row.without as f64), 0),
            number(row.truth_mean, 2),
            percent(row.bias),
            share(row.cv),
            share(row.null_cv),
            share(row.sampling_holds),
        ]);
    }
    let mut cuts = Grid::new();
    output::head(
        &mut cuts,
        ["scene", "trees by", "rows", "planted", "found − planted", "rows right", "border m"],
    );
    for cut in &comparison.cuts {
        cuts.add_row([
            Cell::new(&cut.scene),
            Cell::new(cut.method.name()),
            number(Some(cut.rows as f64), 0),
            number(Some(cut.planted), 1),
            number(Some(cut.count_error), 2),
            number(Some(cut.rows_right as f64), 0),
            number(cut.border_error_m, 3),
        ]);
    }
    format!(
        "{estimators}\nwithout: rows or trees that the estimator gives no number for; all numbers are of the n others\n\n{cuts}\n"
    )
}

fn markdown(comparison: &Comparison) -> String {
    let told = |value: Option<f64>, print: fn(f64) -> String| value.map_or_else(|| "–".to_owned(), print);
    let share = |fraction| told(fraction, |fraction| format!("{:.1}", 100.0 * fraction));
    let mut text = String::from(
        "| scene | of | estimator | quantity | n | truth, mean | bias % | CV % | null CV % | sampling holds, % |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    for row in &comparison.estimators {
        text.push_str(&format!(
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n",
            row.scene,
            scope(row.scope),
            row.estimator,
            row.quantity.key(),
            row.n,
            told(row.truth_mean, |mean| format!("{mean:.2}")),
            told(row.bias, |bias| format!("{:+.1}", 100.0 * bias)),
            share(row.cv),
            share(row.null_cv),
            row.sampling_holds.map_or_else(String::new, |share| format!("{:.0}", 100.0 * share)),
        ));
    }
    text.push_str(
        "\n| scene | trees by | rows | planted | found − planted | rows right | border off, m |\n|---|---|---|---|---|---|---|\n",
    );
    for cut in &comparison.cuts {
        text.push_str(&format!(
            "| {} | {} | {} | {:.1} | {:+.2} | {} | {} |\n",
            cut.scene,
            cut.method.name(),
            cut.rows,
            cut.planted,
            cut.count_error,
            cut.rows_right,
            cut.border_error_m.map_or_else(String::new, |off| format!("{off:.3}")),
        ));
    }
    text
}
