//! `rowscan study transfer`: calibrations carried from one class to another.

use std::path::PathBuf;

use comfy_table::Cell;

use super::class_args::ClassArgs;
use super::shards::ShardArgs;
use super::tell::TellArgs;
use crate::cli::grid::Grid;
use crate::cli::output::{self, percent, say};
use crate::cli::{Failure, Format, Outcome};
use rowscan_study::Whole;
use rowscan_study::transfer::{TransferReport, TransferStudy, report};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    #[command(flatten)]
    classes: ClassArgs,
    /// Rows a class; calibrations are fitted on the first half and tried on the second
    #[arg(long, value_name = "N", default_value_t = 40)]
    rows: usize,
    #[command(flatten)]
    pub(super) shards: ShardArgs,
    #[command(flatten)]
    told: ReportArgs,
    #[command(flatten)]
    tell: TellArgs,
}

/// What of the report is written where.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct ReportArgs {
    /// Write the tables as docs/measurements/accuracy.md holds them
    #[arg(long)]
    markdown: bool,
    /// Write how far apart classes are: what intervals take their between-class term from (canopy/between-class.csv)
    #[arg(long, value_name = "FILE.csv")]
    between_class: Option<PathBuf>,
}

/// Fewest rows a class: two halves on which a line can be fitted.
const FEWEST: usize = 6;

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    if args.rows < FEWEST {
        return Err(Failure::Usage(format!("--rows: expected {FEWEST} or more, found {}", args.rows)));
    }
    args.tell.no_figure("a transfer study")?;
    let study = TransferStudy { classes: args.classes.classes()?, rows: args.rows };
    match args.shards.run(study, args.told.between_class.as_deref()).await? {
        Some(whole) => tell(&args.tell, &args.told, whole),
        None => Ok(Outcome::Done),
    }
}

/// Reports on a whole study.
pub(super) fn tell(
    args: &TellArgs,
    told: &ReportArgs,
    (header, units): Whole<TransferStudy>,
) -> Result<Outcome, Failure> {
    args.no_figure("a transfer study")?;
    let report = report(header, &units);
    if let Some(path) = &told.between_class {
        let command = format!("rowscan study transfer --rows {}", report.provenance.settings.rows);
        output::write_file(path, &report.between_class_csv(&command))?;
        say(format_args!("wrote {}", path.display()));
    }
    match args.format {
        _ if told.markdown => output::print(&markdown(&report))?,
        Format::Json | Format::Jsonl => output::print_json(args.format, &report)?,
        Format::Csv => output::print_rows(args.format, &report.matrix)?,
        Format::Table => output::print(&table(&report))?,
    }
    Ok(Outcome::Done)
}

/// The estimators of a report, in their order.
fn estimators(report: &TransferReport) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = Vec::new();
    for row in &report.left_out {
        if !names.contains(&row.estimator) {
            names.push(row.estimator);
        }
    }
    names
}

/// Every class left out, with the bias of all estimators.
fn table(report: &TransferReport) -> String {
    let names = estimators(report);
    let mut grid = Grid::new();
    output::head(&mut grid, ["axis", "left out"].into_iter().chain(names.iter().copied()));
    for row in report.left_out.iter().filter(|row| Some(&row.estimator) == names.first()) {
        let bias = |estimator: &&str| {
            let own = |other: &&_| same(other, &row.axis, &row.test, estimator);
            percent(report.left_out.iter().find(own).and_then(|found| found.error.bias))
        };
        grid.add_row([Cell::new(&row.axis), Cell::new(&row.test)].into_iter().chain(names.iter().map(bias)));
    }
    let mut between = Grid::new();
    output::head(&mut between, ["axis", "estimator", "from class to class"]);
    for row in &report.between_class {
        between.add_row([
            Cell::new(&row.axis),
            Cell::new(row.estimator),
            output::share(Some(row.relative_sd)),
        ]);
    }
    let header = &report.provenance;
    format!(
        "{grid}\n{between}\n{} rows a class, half to fit on; seed {}, scene {} ({}), rowscan {}\n",
        header.settings.rows, header.seed, header.scene, header.scene_hash, header.rowscan
    )
}

fn same(row: &rowscan_study::transfer::LeftOut, axis: &str, test: &str, estimator: &str) -> bool {
    row.axis == axis && row.test == test && row.estimator == estimator
}

fn markdown(report: &TransferReport) -> String {
    let names = estimators(report);
    let text_of = |bias: Option<f64>, rmse: Option<f64>| {
        bias.zip(rmse).map_or_else(
            || "–".to_owned(),
            |(bias, rmse)| format!("{:+.1} ({:.1})", 100.0 * bias, 100.0 * rmse),
        )
    };
    let mut text =
        format!("| axis | left out | {} |\n|---|---|{}\n", names.join(" | "), "---|".repeat(names.len()));
    for row in report.left_out.iter().filter(|row| Some(&row.estimator) == names.first()) {
        text.push_str(&format!("| {} | {} |", row.axis, row.test));
        for estimator in &names {
            let found = report.left_out.iter().find(|other| same(other, &row.axis, &row.test, estimator));
            text.push_str(&format!(
                " {} |",
                found.map_or_else(String::new, |f| text_of(f.error.bias, f.error.rmse))
            ));
        }
        text.push('\n');
    }
    for axis in report.provenance.settings.classes.axes() {
        let cells: Vec<_> =
            report.matrix.iter().filter(|cell| cell.axis == axis && cell.estimator == "contact").collect();
        let mut tests: Vec<&str> = Vec::new();
        for cell in &cells {
            if !tests.contains(&cell.test.as_str()) {
                tests.push(&cell.test);
            }
        }
        text.push_str(&format!(
            "\n| contact, {axis}: fitted on | {} |\n|---|{}\n",
            tests.join(" | "),
            "---|".repeat(tests.len())
        ));
        for line in cells.chunks(tests.len().max(1)) {
            let train = line.first().map_or("", |cell| cell.train.as_str());
            text.push_str(&format!("| {train} |"));
            for cell in line {
                text.push_str(&format!(" {} |", text_of(cell.error.bias, cell.error.rmse)));
            }
            text.push('\n');
        }
    }
    text.push_str(&format!("\n| axis | {} |\n|---|{}\n", names.join(" | "), "---|".repeat(names.len())));
    for axis in report.provenance.settings.classes.axes() {
        text.push_str(&format!("| {axis} |"));
        for estimator in &names {
            let found =
                report.between_class.iter().find(|row| row.axis == axis && row.estimator == *estimator);
            text.push_str(&format!(
                " {} |",
                found.map_or_else(|| "–".to_owned(), |row| format!("{:.1}", 100.0 * row.relative_sd))
            ));
        }
        text.push('\n');
    }
    text
}
