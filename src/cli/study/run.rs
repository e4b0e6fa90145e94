//! `rowscan study run`: a study from a file.

use std::path::PathBuf;

use comfy_table::Cell;

use super::shards::ShardArgs;
use super::tell::TellArgs;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, say};
use crate::cli::{Failure, Format, Outcome};
use rowscan_study::sweep::{self, SweepReport, SweepStudy};
use rowscan_study::{Whole, figure};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// The study: keys of a scene or its rig to sweep, and the outputs to keep; docs/studies.md says how
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Seed of the study instead of the file's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Orchards a point instead of the file's
    #[arg(long, value_name = "N")]
    repeats: Option<usize>,
    #[command(flatten)]
    pub(super) shards: ShardArgs,
    #[command(flatten)]
    tell: TellArgs,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let study = sweep::read(&args.file, args.seed, args.repeats, say)?;
    match args.shards.run(study, args.tell.files()).await? {
        Some(whole) => tell(&args.tell, whole),
        None => Ok(Outcome::Done),
    }
}

/// Reports on a whole study.
pub(super) fn tell(args: &TellArgs, (header, units): Whole<SweepStudy>) -> Result<Outcome, Failure> {
    let report = sweep::report(header, &units);
    args.draw(|| figure::sweep(&report))?;
    match args.format {
        Format::Json | Format::Jsonl => output::print_json(args.format, &report)?,
        Format::Csv => output::print_rows(args.format, &report.rows)?,
        Format::Table => output::print(&table(&report))?,
    }
    // A study of nothing is none.
    Ok(if report.refused == report.rows.len() { Outcome::Finding } else { Outcome::Done })
}

fn table(report: &SweepReport) -> String {
    let mut grid = Grid::new();
    output::head(&mut grid, ["axis", "at", "output", "n", "of", "mean", "sd", "mean |…|"]);
    for effect in &report.effects {
        let known = |value: f64| Some(value).filter(|value| value.is_finite());
        grid.add_row([
            Cell::new(&effect.axis),
            Cell::new(&effect.at),
            Cell::new(&effect.output),
            number(Some(effect.n as f64), 0),
            number(Some(effect.of as f64), 0),
            number(known(effect.mean), 4),
            number(effect.sd.and_then(known), 4),
            number(known(effect.mean_abs), 4),
        ]);
    }
    let first = report.rows.iter().find_map(|row| row.get("refused")?.as_str());
    let refused = first.map_or_else(String::new, |why| {
        format!("{} of {} could not be tried, the first: {why}\n", report.refused, report.rows.len())
    });
    let header = &report.provenance;
    format!(
        "{grid}\n{refused}{} points × {} orchards; seed {}, scene {} ({}), rowscan {}\n",
        header.settings.points(),
        header.settings.repeats,
        header.seed,
        header.scene,
        header.scene_hash,
        header.rowscan,
    )
}
