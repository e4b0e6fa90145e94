//! `rowscan study budget`: what makes the estimators' errors, term by term.

use comfy_table::Cell;

use super::keep::KeepArgs;
use super::rows::Seeds;
use crate::cli::blocking::off_runtime;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, percent, share};
use crate::cli::scene::RowSceneArgs;
use crate::cli::{Failure, Format, Outcome, progress};
use rowscan_study::budget::{BudgetReport, TermSummary, budgets, report};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    #[command(flatten)]
    scene: RowSceneArgs,
    /// Seeds of the rows, first..last
    #[arg(long, value_name = "A..B", default_value = "1..10")]
    seeds: Seeds,
    /// Write the table as docs/measurements/accuracy.md holds it
    #[arg(long, conflicts_with = "format")]
    markdown: bool,
    #[command(flatten)]
    keep: KeepArgs,
    /// How to write the table; JSON holds the rows too
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let scene = args.scene.scene()?;
    let model = args.scene.model(&scene.resolved_rig(), 0)?;
    let (name, seeds) = (scene.name.clone(), args.seeds.0);
    let bar = progress::bar("taking apart", "rows", seeds.len() as u64);
    let kept = args.keep.open()?;
    let work = move || {
        let rows = budgets(&scene, &seeds, model, &kept.archive, &|| bar.inc(1));
        bar.finish_and_clear();
        kept.tell();
        rows
    };
    let report = report(&name, model.name, off_runtime("take the errors apart", work).await?);
    match args.format {
        _ if args.markdown => output::print(&markdown(&report))?,
        Format::Json | Format::Jsonl => output::print_json(args.format, &report)?,
        Format::Csv => output::print_rows(args.format, &report.terms)?,
        Format::Table => output::print(&table(&report))?,
    }
    // Rows of which no leaf area is told have no error to take apart.
    Ok(if report.terms.iter().any(|term| term.n > 0) { Outcome::Done } else { Outcome::Finding })
}

fn table(report: &BudgetReport) -> String {
    let mut grid = Grid::new();
    output::head(&mut grid, ["estimator", "term", "n", "mean", "sd"]);
    for term in &report.terms {
        grid.add_row([
            Cell::new(term.estimator),
            Cell::new(term.term),
            number(Some(term.n as f64), 0),
            percent(term.mean),
            share(term.sd),
        ]);
    }
    format!("{grid}\n{}, {}: percent of the true leaf area\n", report.scene, report.model)
}

/// One row an estimator, one column a term.
fn markdown(report: &BudgetReport) -> String {
    let mut terms: Vec<&str> = Vec::new();
    let mut estimators: Vec<&str> = Vec::new();
    for TermSummary { estimator, term, .. } in &report.terms {
        if !terms.contains(term) {
            terms.push(term);
        }
        if !estimators.contains(estimator) {
            estimators.push(estimator);
        }
    }
    let mut text =
        format!("| {} | {} |\n|---|{}\n", report.scene, terms.join(" | "), "---|".repeat(terms.len()));
    for estimator in estimators {
        text.push_str(&format!("| {estimator} |"));
        for term in &terms {
            let found = report.terms.iter().find(|own| own.estimator == estimator && own.term == *term);
            let cell = found.and_then(|own| {
                let mean = format!("{:+.1}", 100.0 * own.mean?);
                Some(own.sd.map_or(mean.clone(), |sd| format!("{mean} ± {:.1}", 100.0 * sd)))
            });
            text.push_str(&format!(" {} |", cell.unwrap_or_else(|| "–".to_owned())));
        }
        text.push('\n');
    }
    text
}
