//! `rowscan study sides`: a row from one alley, from the other, and from both as one, against the truth.

use comfy_table::Cell;
use rowscan_protocol::model::AnyModel;

use super::keep::KeepArgs;
use super::rows::{Seeds, distances_m, named_scenes};
use crate::cli::blocking::off_runtime;
use crate::cli::grid::Grid;
use crate::cli::output::{self, share};
use crate::cli::{Failure, Format, Outcome, models, progress};
use rowscan_study::sides::{SidesFound, SidesStudy, passes, try_sides};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// Scene files, or names of built-in scenes
    #[arg(value_name = "SCENE", default_values = ["spindle", "mature"])]
    scene: Vec<String>,
    /// Seeds of the rows, first..last
    #[arg(long, value_name = "A..B", default_value = "1301..1320")]
    seeds: Seeds,
    /// Scanner models
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = models::name(), hide_possible_values = true, default_value = "lms111,lms511,picoscan150")]
    model: Vec<String>,
    /// Distance from the mirror to the row plane, metres, in either alley
    #[arg(long, value_name = "METRES", default_value = "2")]
    distance: f64,
    #[command(flatten)]
    keep: KeepArgs,
    /// How to write the table; CSV, JSON and JSON lines hold a row a way
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let distances_m = distances_m(&[args.distance])?;
    let scenes = named_scenes(&args.scene)?;
    let models: Vec<AnyModel> = args.model.iter().map(|name| models::find(name)).collect::<Result<_, _>>()?;
    let distance_m = distances_m.first().copied().unwrap_or(args.distance);
    let asked = SidesStudy { scenes, seeds: args.seeds.0.clone(), models, distance_m };
    let bar = progress::bar("driving past", "rows", passes(&asked) as u64);
    let kept = args.keep.open()?;
    let work = move || {
        let found = try_sides(&asked, &kept.archive, &|| bar.inc(1));
        bar.finish_and_clear();
        kept.tell();
        found
    };
    let found = off_runtime("try both sides", work).await?;
    match args.format {
        Format::Json => output::print_json(args.format, &found)?,
        Format::Jsonl | Format::Csv => output::print_rows(args.format, &found)?,
        Format::Table => output::print(&listed(&found))?,
    }
    // A study of nothing is none.
    Ok(if found.iter().all(|way| way.rows == 0) { Outcome::Finding } else { Outcome::Done })
}

fn listed(found: &[SidesFound]) -> String {
    let mut grid = Grid::new();
    let heads = [
        "scene",
        "model",
        "beams",
        "from",
        "n",
        "withheld",
        "bias",
        "sd",
        "holds",
        "±",
        "hidden",
        "tree RMSE",
        "tree sd",
    ];
    output::head(&mut grid, heads.to_vec());
    for row in found {
        let head = [&row.scene, row.model, row.beams, row.from.name()].map(Cell::new);
        let known = [row.bias, row.sd, row.holds, row.half_width, row.hidden, row.tree_rmse, row.tree_sd];
        let counts = [row.rows, row.withheld].map(Cell::new);
        grid.add_row(head.into_iter().chain(counts).chain(known.map(share)));
    }
    format!(
        "{grid}\nn: rows that every way tells, which all numbers are of; withheld: rows whose leaf area this way withholds;\nbias, sd: of estimate / truth − 1 over rows; holds: share of the intervals that hold the truth; hidden: voxels that too few beams\nentered; tree RMSE: of a tree as measured over its row's true mean; tree sd: the same without the row's own error\n"
    )
}
