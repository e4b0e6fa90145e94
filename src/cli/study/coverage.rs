//! `rowscan study coverage`: how often intervals hold the truth.

use comfy_table::Cell;

use super::class_args::ClassArgs;
use super::shards::ShardArgs;
use super::tell::TellArgs;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, percent, share};
use crate::cli::{Failure, Format, Outcome};
use rowscan_study::Whole;
use rowscan_study::coverage::{CoverageReport, CoverageStudy, Share, report};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    #[command(flatten)]
    classes: ClassArgs,
    /// Rows a class
    #[arg(long, value_name = "N", default_value_t = 200)]
    rows: usize,
    #[command(flatten)]
    pub(super) shards: ShardArgs,
    #[command(flatten)]
    tell: TellArgs,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    if args.rows == 0 {
        return Err(Failure::Usage("--rows: expected 1 or more, found 0".to_owned()));
    }
    args.tell.no_figure("a coverage study")?;
    let study = CoverageStudy { classes: args.classes.classes()?, rows: args.rows };
    match args.shards.run(study, []).await? {
        Some(whole) => tell(&args.tell, whole),
        None => Ok(Outcome::Done),
    }
}

/// Reports on a whole study.
pub(super) fn tell(args: &TellArgs, (header, units): Whole<CoverageStudy>) -> Result<Outcome, Failure> {
    args.no_figure("a coverage study")?;
    let report = report(header, &units);
    match args.format {
        Format::Json | Format::Jsonl => output::print_json(args.format, &report)?,
        Format::Csv => output::print_rows(args.format, &report.rows)?,
        Format::Table => output::print(&table(&report))?,
    }
    Ok(Outcome::Done)
}

fn table(report: &CoverageReport) -> String {
    let held = |share: Option<Share>| {
        Cell::new(share.map_or_else(
            || "–".to_owned(),
            |Share { share, low, high }| {
                format!("{:.0} % ({:.0} to {:.0})", 100.0 * share, 100.0 * low, 100.0 * high)
            },
        ))
    };
    let counted = |n: usize, withheld: usize| match withheld {
        0 => number(Some(n as f64), 0),
        _ => Cell::new(format!("{n} of {}", n + withheld)),
    };
    let mut grid = Grid::new();
    output::head(
        &mut grid,
        [
            "axis",
            "class",
            "n",
            "bias",
            "RMSE",
            "sampling error holds",
            "interval holds",
            "half width",
            "silent",
        ],
    );
    for row in &report.rows {
        grid.add_row([
            Cell::new(&row.axis),
            Cell::new(&row.class),
            counted(row.n, row.withheld),
            percent(row.bias),
            share(row.rmse),
            held(row.sampling_holds),
            held(row.interval_holds),
            share(row.half_width),
            number(Some(row.silent as f64), 0),
        ]);
    }
    let header = &report.provenance;
    format!(
        "{grid}\nin brackets Wilson's 95 % interval; silent: rows without a warning that are 25 % or two half widths off; seed {}, scene {} ({}), rowscan {}\n",
        header.seed, header.scene, header.scene_hash, header.rowscan
    )
}
