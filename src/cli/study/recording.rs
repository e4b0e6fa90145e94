//! `rowscan study recording`: a recording of a scene that stands still, beside our model of the device.

use comfy_table::Cell;
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_study::recorded::{Edge, Found, Series, SideBySide, compare};

use crate::cli::grid::Grid;
use crate::cli::output::{self, number};
use crate::cli::{Failure, Format, Outcome, models};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// A recording of any kind of a scene that stands still, with `#STREAM` behind it where it holds several
    file: Source,
    /// The model it is compared with
    #[arg(long, value_name = "NAME", value_parser = models::name(), hide_possible_values = true)]
    model: String,
    /// Seed of the model's unit
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Write the rows as docs/measurements/recordings.md holds them
    #[arg(long, conflicts_with = "format")]
    markdown: bool,
    /// How to write the comparison; CSV holds a number a row
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let model = models::find(&args.model)?;
    if args.file.file().is_none() {
        return Err(Failure::Usage(format!("{} is live: `rowscan record` it first", args.file)));
    }
    let mut scanner = Scanner::open(&args.file, DriverConfig::default()).await?;
    let mut series = Series::default();
    while let Some(record) = scanner.next().await? {
        series.push(record.scan);
        tokio::task::coop::consume_budget().await;
    }
    let found = compare(&series, model, args.seed)
        .map_err(|cause| Failure::Usage(format!("{}: {cause}", args.file)))?;
    match args.format {
        _ if args.markdown => output::print(&markdown(&found))?,
        Format::Json | Format::Jsonl => output::print_json(args.format, &found)?,
        Format::Csv => output::print_rows(args.format, &lines(&found))?,
        Format::Table => output::print(&table(&found))?,
    }
    Ok(Outcome::Done)
}

/// One number of both.
#[derive(Debug, serde::Serialize)]
struct Line {
    what: String,
    recorded: Option<f64>,
    modelled: Option<f64>,
}

fn lines(found: &SideBySide) -> Vec<Line> {
    let line = |what: &str, of: &dyn Fn(&Found) -> Option<f64>| Line {
        what: what.to_owned(),
        recorded: of(&found.recorded).filter(|value| value.is_finite()),
        modelled: of(&found.modelled).filter(|value| value.is_finite()),
    };
    let quartile = |at: usize| move |found: &Found| found.scatter.sigma_mm.get(at).copied();
    let allan = |at: usize| move |found: &Found| *found.scatter.allan_mm.get(at)?;
    let edge = |of: fn(&Edge) -> f64| {
        move |found: &Found| {
            let n = found.edges.len() as f64;
            (n > 0.0).then(|| found.edges.iter().map(of).sum::<f64>() / n)
        }
    };
    vec![
        line("scans", &|found| Some(found.scatter.scans as f64)),
        line("beams with an echo in every scan", &|found| Some(found.scatter.beams as f64)),
        line("of those, sd above 3 × the median", &|found| Some(found.scatter.loose as f64)),
        line("sigma, lower quartile, mm", &quartile(0)),
        line("sigma, median, mm", &quartile(1)),
        line("sigma, upper quartile, mm", &quartile(2)),
        line("kurtosis", &|found| Some(found.scatter.kurtosis)),
        line("correlation, scan before", &|found| Some(found.scatter.lag_one)),
        line("correlation, next beam", &|found| Some(found.scatter.neighbour)),
        line("ADEV of 1 scan, mm", &allan(0)),
        line("ADEV of 4 scans, mm", &allan(1)),
        line("ADEV of 10 scans, mm", &allan(2)),
        line("ADEV of 20 scans, mm", &allan(3)),
        line("pattern over the beams, mm", &|found| found.scatter.pattern_mm),
        line("edges", &|found| Some(found.edges.len() as f64)),
        line("beams on a ramp, 10 to 90 %, mean", &edge(|edge| edge.beams as f64)),
        line("disc / nominal spot, mean", &edge(|edge| edge.diameter_ratio)),
        line("ramp off the disc, rms share, mean", &edge(|edge| edge.rms_share)),
    ]
}

fn table(found: &SideBySide) -> String {
    let mut grid = Grid::new();
    output::head(&mut grid, ["", "recorded", found.model]);
    for line in lines(found) {
        grid.add_row([Cell::new(&line.what), number(line.recorded, 3), number(line.modelled, 3)]);
    }
    let mut edges = Grid::new();
    output::head(&mut edges, ["edges", "at °", "near mm", "far mm", "beams", "disc / nominal", "rms share"]);
    for (whose, found) in [("recorded", &found.recorded), (found.model, &found.modelled)] {
        for edge in &found.edges {
            edges.add_row([
                Cell::new(whose),
                number(Some(edge.angle_deg), 2),
                number(Some(edge.near_mm), 0),
                number(Some(edge.far_mm), 0),
                number(Some(edge.beams as f64), 0),
                number(Some(edge.diameter_ratio), 2),
                number(Some(edge.rms_share), 3),
            ]);
        }
    }
    format!("{grid}\n{edges}\n")
}

fn markdown(found: &SideBySide) -> String {
    let mut text = format!("| | recorded | {} |\n|---|---|---|\n", found.model);
    let shown = |value: Option<f64>| match value {
        Some(value) if value.fract() == 0.0 => format!("{value:.0}"),
        Some(value) => format!("{value:.2}"),
        None => String::new(),
    };
    for line in lines(found) {
        text.push_str(&format!("| {} | {} | {} |\n", line.what, shown(line.recorded), shown(line.modelled)));
    }
    text
}
