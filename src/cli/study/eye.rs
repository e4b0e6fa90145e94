//! `rowscan study eye`: leaf area through the device's optics, by model and distance, beside the truth.

use comfy_table::Cell;
use rowscan_protocol::model::AnyModel;

use super::keep::KeepArgs;
use super::rows::{Seeds, distances_m, named_scenes};
use crate::cli::blocking::off_runtime;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, percent};
use crate::cli::{Failure, Format, Outcome, models, progress};
use rowscan_study::eye::{Seen, ThroughTheEye, Way, through_the_eye};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// Scene files, or names of built-in scenes
    #[arg(value_name = "SCENE", default_value = "spindle")]
    scene: Vec<String>,
    /// Seeds of the rows, first..last
    #[arg(long, value_name = "A..B", default_value = "401..420")]
    seeds: Seeds,
    /// Scanner models
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = models::name(), hide_possible_values = true, default_value = "lms111,lms511,tim561,lms291")]
    model: Vec<String>,
    /// Distances from the mirror to the row plane, metres
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1,2,4")]
    distance: Vec<f64>,
    /// Write the table as docs/measurements/eye.md holds it
    #[arg(long, conflicts_with = "format")]
    markdown: bool,
    #[command(flatten)]
    keep: KeepArgs,
    /// How to write the table; CSV, JSON and JSON lines hold a row an estimator
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let distances_m = distances_m(&args.distance)?;
    let scenes = named_scenes(&args.scene)?;
    let models: Vec<AnyModel> = args.model.iter().map(|name| models::find(name)).collect::<Result<_, _>>()?;
    let seeds = args.seeds.0.clone();
    let passes = scenes.len() * seeds.len() * models.len() * distances_m.len();
    let asked = ThroughTheEye { scenes, seeds, models, distances_m };
    let bar = progress::bar("driving past", "rows", passes as u64);
    let kept = args.keep.open()?;
    let work = move || {
        let seen = through_the_eye(&asked, &kept.archive, &|| bar.inc(1));
        bar.finish_and_clear();
        kept.tell();
        seen
    };
    let seen = off_runtime("look through the eye", work).await?;
    match args.format {
        _ if args.markdown => output::print(&markdown(&seen))?,
        Format::Json => output::print_json(args.format, &seen)?,
        Format::Jsonl | Format::Csv => output::print_rows(args.format, &seen)?,
        Format::Table => output::print(&table(&seen))?,
    }
    Ok(Outcome::Done)
}

fn table(seen: &[Seen]) -> String {
    let mut grid = Grid::new();
    let heads = ["scene", "model", "m", "estimator", "rows", "median", "mean", "sd", "holds", "± width"];
    output::head(&mut grid, heads.to_vec());
    for row in seen {
        let head = [Cell::new(&row.scene), Cell::new(row.model), number(Some(row.distance_m), 1)];
        let of = [Cell::new(row.way.name()), Cell::new(format!("{} of {}", row.n, row.rows))];
        let errors = [row.median, row.mean, row.sd, row.holds.map(|[share, _, _]| share), row.half_width];
        grid.add_row(head.into_iter().chain(of).chain(errors.into_iter().map(percent)));
    }
    format!(
        "{grid}\nmedian, mean, sd: of estimate / truth − 1; holds: share of the intervals that hold the truth\n"
    )
}

/// One row a place; of each way the mean error and its standard deviation, of the leaf area its median and what its interval holds, too.
fn markdown(seen: &[Seen]) -> String {
    let signed = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| format!("{:+.1}", 100.0 * v));
    let plain = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| format!("{:.0}", 100.0 * v));
    let mut text = String::from("| scene | model | m |");
    for way in Way::ALL {
        text.push_str(&format!(" {} |", way.name()));
    }
    text.push_str(" median | interval holds | ± |\n|---|---|---|");
    text.push_str(&"---|".repeat(Way::ALL.len() + 3));
    text.push('\n');
    for place in seen.chunks(Way::ALL.len()) {
        let Some(first) = place.first() else { continue };
        text.push_str(&format!("| {} | {} | {} |", first.scene, first.model, first.distance_m));
        for row in place {
            let sd = row.sd.map_or_else(String::new, |sd| format!(" ± {:.1}", 100.0 * sd));
            text.push_str(&format!(" {}{sd} |", signed(row.mean)));
        }
        let leaf = place.iter().find(|row| row.way == Way::LeafArea);
        let holds = leaf.and_then(|leaf| leaf.holds);
        let holds = holds.map_or_else(
            || "–".to_owned(),
            |[share, low, high]| {
                format!("{} ({}..{})", plain(Some(share)), plain(Some(low)), plain(Some(high)))
            },
        );
        let median = signed(leaf.and_then(|leaf| leaf.median));
        text.push_str(&format!(" {median} | {holds} | {} |\n", plain(leaf.and_then(|leaf| leaf.half_width))));
    }
    text
}
