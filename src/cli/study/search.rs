//! `rowscan study search`: under which settings the paper's numbers come out.

use std::path::PathBuf;

use comfy_table::Cell;
use rowscan_canopy::reference::PAPER;
use serde_json::Value;

use super::confirmed;
use super::points::{gates, range, words};
use super::rows::Seeds;
use super::shards::{ShardArgs, whole};
use super::tell::TellArgs;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, say};
use crate::cli::{Failure, Format, Outcome};
use rowscan_study::Whole;
use rowscan_study::search::{self, ConfirmStudy, PointReport, SearchReport, SearchStudy};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// The search: a base, knobs with their values, and seeds; docs/paper.md says how
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Try points of the search on these seeds instead, which may not be seeds that the search has seen, and report them with intervals
    #[arg(long, value_name = "A..B")]
    confirm: Option<Seeds>,
    /// The points to confirm, by number: 0 is the base; without this or --selected all
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        requires = "confirm",
        conflicts_with = "selected"
    )]
    points: Vec<usize>,
    /// Confirm the base and the --best nearest points of the finished search in these files
    #[arg(long, value_name = "FILE", value_delimiter = ',', requires = "confirm")]
    selected: Vec<PathBuf>,
    /// Write confirmed points as docs/paper.md holds them
    #[arg(long, requires = "confirm", conflicts_with = "format")]
    markdown: bool,
    #[command(flatten)]
    pub(super) shards: ShardArgs,
    /// How many of the nearest points the table shows, or --selected takes
    #[arg(long, value_name = "N", default_value_t = BEST)]
    best: usize,
    #[command(flatten)]
    tell: TellArgs,
}

/// Points that the table shows unless told otherwise.
pub(super) const BEST: usize = 10;

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    args.tell.no_figure("a search")?;
    let study = search::read(&args.file, say)?;
    if let Some(Seeds(seeds)) = args.confirm {
        let points = match (args.selected.as_slice(), args.points) {
            ([], points) if points.is_empty() => (0..study.points()).collect(),
            ([], points) => points,
            (files, _) => {
                let (header, units) = whole::<SearchStudy>(files)?;
                search::nearest_points(&study, &search::report(header, &units), args.best)?
            }
        };
        let study = ConfirmStudy::new(study, points, seeds)?;
        return match args.shards.run(study, []).await? {
            Some(whole) => confirmed::tell(&args.tell, args.markdown, whole),
            None => Ok(Outcome::Done),
        };
    }
    match args.shards.run(study, []).await? {
        Some(whole) => tell(&args.tell, args.best, whole),
        None => Ok(Outcome::Done),
    }
}

/// Reports on a whole search.
pub(super) fn tell(
    args: &TellArgs,
    best: usize,
    (header, units): Whole<SearchStudy>,
) -> Result<Outcome, Failure> {
    args.no_figure("a search")?;
    let report = search::report(header, &units);
    match args.format {
        Format::Json | Format::Jsonl => output::print_json(args.format, &report)?,
        Format::Csv => output::print_rows(args.format, &report.points.iter().map(row).collect::<Vec<_>>())?,
        Format::Table => output::print(&table(&report, best))?,
    }
    Ok(Outcome::Done)
}

/// A point on one line of CSV.
fn row(point: &PointReport) -> serde_json::Map<String, Value> {
    let mut row = serde_json::Map::new();
    row.insert("point".to_owned(), point.point.into());
    row.insert("settings".to_owned(), words(point).into());
    row.insert("seeds".to_owned(), point.seeds.into());
    row.insert("confirmed".to_owned(), point.confirmed.into());
    row.insert("slope_distance".to_owned(), point.slope_distance.into());
    row.insert("r2_lead".to_owned(), point.r2_lead.into());
    for (place, paper) in PAPER.iter().enumerate() {
        let own = point.regressions.get(place);
        let mut put = |what: &str, value: Option<f64>| {
            row.insert(format!("eq{}_{what}", paper.equation), value.into());
        };
        put("slope", own.map(|own| own.slope));
        put("intercept_m2", own.map(|own| own.intercept_m2));
        put("r2", own.map(|own| own.r2));
    }
    row
}

fn table(report: &SearchReport, best: usize) -> String {
    let header = &report.provenance;
    let base = || report.points.iter().take(1);
    let singles: Vec<&PointReport> =
        base().chain(report.points.iter().filter(|point| point.single)).collect();
    let nearest: Vec<&PointReport> = report.nearest().into_iter().take(best).collect();
    let refused = report.points.iter().filter(|point| point.refused.is_some());
    let first = refused.clone().find_map(|point| point.refused.as_deref());
    let refused = first.map_or_else(String::new, |why| {
        format!("{} points could not be tried at every seed, the first: {why}\n", refused.count())
    });
    let singles = if singles.len() > 1 {
        format!("one knob turned at a time\n{}\n\n", points(&singles))
    } else {
        String::new()
    };
    format!(
        "{singles}nearest to the paper's slopes, of {} points\n{}\n\n{}\n{refused}medians over seeds {:?}; scene {} ({}), rowscan {}\n\
         unconfirmed: these seeds chose the order of the points; `study search FILE --confirm A..B` tries points on others\n",
        report.points.len(),
        points(&nearest),
        gates(&base().chain(nearest.iter().copied().filter(|point| point.point != 0)).collect::<Vec<_>>()),
        header.settings.seeds,
        header.scene,
        header.scene_hash,
        header.rowscan,
    )
}

/// Points with their six slopes and R², the paper's first.
fn points(points: &[&PointReport]) -> Grid {
    let mut table = Grid::new();
    let symbols = ["lateral I_L", "I_T", "I_3L", "zenith I_L", "I_T", "I_3L"];
    output::head(&mut table, ["point"].into_iter().chain(symbols).chain(["R²", "off", "L_A m²", "settings"]));
    let mut paper = vec![Cell::new("paper")];
    paper.extend(PAPER.iter().map(|paper| number(Some(paper.slope), 2)));
    paper.push(Cell::new(range(PAPER.iter().map(|paper| paper.r2))));
    table.add_row(paper);
    for point in points {
        let mut row = vec![Cell::new(point.point)];
        let slope = |place: usize| number(point.regressions.get(place).map(|own| own.slope), 2);
        row.extend((0..PAPER.len()).map(slope));
        row.push(Cell::new(range(point.regressions.iter().map(|own| own.r2))));
        row.push(number(point.slope_distance, 2));
        row.push(number(point.leaf_area_m2, 1));
        row.push(Cell::new(if point.settings.is_empty() { "base".to_owned() } else { words(point) }));
        table.add_row(row);
    }
    table
}
