//! `rowscan study clumping`: what a row's own scans say of its clumps, fitted and tried on training systems left out.

use comfy_table::Cell;
use rowscan_protocol::model::AnyModel;

use super::keep::KeepArgs;
use super::rows::{Seeds, distances_m, named_scenes};
use crate::cli::blocking::off_runtime;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, percent, share};
use crate::cli::{Failure, Format, Outcome, models, progress};
use rowscan_study::clumping::{ClumpingReport, ClumpingStudy, rows, try_clumping};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// Scene files, or names of built-in scenes: a training system each
    #[arg(value_name = "SCENE", default_values = ["spindle", "tall_spindle", "vase", "hedge", "fruiting_wall", "mature"])]
    scene: Vec<String>,
    /// Leaf area indices of the rows
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "0.8,1.2,1.6,2,2.6")]
    lai: Vec<f64>,
    /// Seeds of the rows, first..last
    #[arg(long, value_name = "A..B", default_value = "601..602")]
    seeds: Seeds,
    /// Scanner models
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = models::name(), hide_possible_values = true, default_value = "lms111")]
    model: Vec<String>,
    /// Distances from the mirror to the row plane, metres
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1.5,2,3")]
    distance: Vec<f64>,
    #[command(flatten)]
    keep: KeepArgs,
    /// How to write the laws; CSV and JSON lines hold one a model, JSON the rows too
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let distances_m = distances_m(&args.distance)?;
    if let Some(lai) = args.lai.iter().find(|lai| !(0.05..=20.0).contains(*lai)) {
        return Err(Failure::Usage(format!("--lai: expected leaf area indices of 0.05 to 20, found {lai}")));
    }
    let scenes = named_scenes(&args.scene)?;
    let models: Vec<AnyModel> = args.model.iter().map(|name| models::find(name)).collect::<Result<_, _>>()?;
    let asked =
        ClumpingStudy { scenes, lais: args.lai.clone(), seeds: args.seeds.0.clone(), models, distances_m };
    let bar = progress::bar("driving past", "rows", rows(&asked) as u64);
    let kept = args.keep.open()?;
    let work = move || {
        let found = try_clumping(&asked, &kept.archive, &|| bar.inc(1));
        bar.finish_and_clear();
        kept.tell();
        found
    };
    let found = off_runtime("fit how leaves stand", work).await?;
    match args.format {
        Format::Json => output::print_json(args.format, &found)?,
        Format::Jsonl | Format::Csv => output::print_rows(args.format, &found.laws)?,
        Format::Table => output::print(&listed(&found))?,
    }
    Ok(Outcome::Done)
}

fn listed(found: &ClumpingReport) -> String {
    let mut laws = Grid::new();
    let heads = ["model", "rows", "constant", "slope", "κ: median", "κ: rms", "median", "rms"];
    output::head(&mut laws, heads.to_vec());
    for law in &found.laws {
        let count = number(Some(law.rows as f64), 0);
        let numbers = [law.constant, law.slope].map(|value| number(Some(value), 3));
        let errors = [law.constant_median, law.constant_sd, law.left_out_median, law.relative_sd];
        let errors = errors.map(|value| share(Some(value)));
        laws.add_row([Cell::new(law.model), count].into_iter().chain(numbers).chain(errors));
    }
    let mut parts = Grid::new();
    output::head(&mut parts, ["model", "rows of", "n", "κ", "law"].to_vec());
    for part in &found.parts {
        let count = number(Some(part.rows as f64), 0);
        let errors = [part.constant, part.law].map(|value| percent(Some(value)));
        let head = [Cell::new(part.model), Cell::new(&part.part), count];
        parts.add_row(head.into_iter().chain(errors));
    }
    format!(
        "{laws}\n{parts}\nfactor = exp(constant + slope · ln closed); errors: of leaf area by the eye over that by rays, no calibration;\nκ: by the constant that estimates without a law have; median, rms, law: by a law that was fitted without the row's training system\n"
    )
}
