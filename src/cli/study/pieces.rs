//! `rowscan study pieces`: single trees and metres against the truth, by model, distance and length.

use std::path::PathBuf;

use comfy_table::Cell;
use rowscan_protocol::model::AnyModel;

use super::keep::KeepArgs;
use super::rows::{Seeds, distances_m, named_scenes};
use crate::cli::blocking::off_runtime;
use crate::cli::estimate::band_m;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, share};
use crate::cli::{Failure, Format, Outcome, models, progress};
use rowscan_study::pieces::{PiecesFound, PiecesStudy, passes, table, try_pieces};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// Scene files, or names of built-in scenes
    #[arg(value_name = "SCENE", default_values = ["spindle", "mature"])]
    scene: Vec<String>,
    /// Seeds of the rows, first..last
    #[arg(long, value_name = "A..B", default_value = "1201..1210")]
    seeds: Seeds,
    /// Scanner models
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = models::name(), hide_possible_values = true, default_value = "lms111,lms511,tim561,lms291")]
    model: Vec<String>,
    /// Distances from the mirror to the row plane, metres
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1,2,4")]
    distance: Vec<f64>,
    /// Height of a band of the profile, metres: 0.1 to 0.5
    #[arg(long, value_name = "METRES", value_parser = band_m, default_value = "0.25")]
    band: f64,
    /// Write the errors by length: what estimates take the error of their pieces from (canopy/pieces.csv)
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Write the table as docs/measurements/pieces.md holds it
    #[arg(long, conflicts_with = "format")]
    markdown: bool,
    #[command(flatten)]
    keep: KeepArgs,
    /// How to write the table; CSV, JSON and JSON lines hold a row a kind of piece
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let distances_m = distances_m(&args.distance)?;
    let scenes = named_scenes(&args.scene)?;
    let models: Vec<AnyModel> = args.model.iter().map(|name| models::find(name)).collect::<Result<_, _>>()?;
    if let Some(path) = &args.table {
        output::can_be_written(path)?;
    }
    let asked = PiecesStudy { scenes, seeds: args.seeds.0.clone(), models, distances_m, band_m: args.band };
    let bar = progress::bar("driving past", "rows", passes(&asked) as u64);
    let kept = args.keep.open()?;
    let work = move || {
        let found = try_pieces(&asked, &kept.archive, &|| bar.inc(1));
        bar.finish_and_clear();
        kept.tell();
        found
    };
    let found = off_runtime("try trees and metres", work).await?;
    if let Some(path) = &args.table {
        output::write_file(path, &table(&found, &about(&args)))?;
    }
    match args.format {
        _ if args.markdown => output::print(&markdown(&found))?,
        Format::Json => output::print_json(args.format, &found)?,
        Format::Jsonl | Format::Csv => output::print_rows(args.format, &found)?,
        Format::Table => output::print(&listed(&found))?,
    }
    // A study of nothing is none.
    Ok(if found.iter().all(|row| row.pieces == 0) { Outcome::Finding } else { Outcome::Done })
}

/// The table's first lines: what made it.
fn about(args: &Args) -> String {
    let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let (first, last) =
        (args.seeds.0.first().copied().unwrap_or(0), args.seeds.0.last().copied().unwrap_or(0));
    format!(
        "# rowscan study pieces {} --seeds {first}..{last} --model {} --distance {}\n# rowscan {}; standard deviations over the row's mean leaf area a metre, of pieces of 1 m; longer ones: times length ^ -exponent\n",
        args.scene.join(" "),
        args.model.join(","),
        list(&args.distance),
        env!("CARGO_PKG_VERSION"),
    )
}

/// Bands of height, of rows and of trees.
fn is_band(row: &PiecesFound) -> bool {
    row.piece.ends_with("band")
}

fn listed(found: &[PiecesFound]) -> String {
    let heads = [
        "by", "model", "m", "piece", "n", "withheld", "r", "error", "true", "RMSE raw", "RMSE", "holds", "±",
    ];
    let table = |bands: bool| {
        let mut grid = Grid::new();
        let heads = heads.into_iter().chain(bands.then_some("median"));
        output::head(&mut grid, heads.collect::<Vec<_>>());
        for row in found.iter().filter(|row| is_band(row) == bands) {
            let way = format!("{} {}", row.way.count, row.way.beams);
            let head = [
                Cell::new(way),
                Cell::new(row.model),
                number(Some(row.distance_m), 1),
                Cell::new(&row.piece),
            ];
            let of = [Cell::new(row.pieces), Cell::new(row.rows_withheld), number(row.r, 2)];
            let known = [row.error_sd, row.truth_sd, row.rmse_unshrunk, row.rmse].map(share);
            let last =
                [row.holds, row.half_width].into_iter().chain(bands.then_some(row.median_error)).map(share);
            grid.add_row(head.into_iter().chain(of).chain(known).chain(last));
        }
        grid
    };
    let (pieces, bands) = (table(false), table(true));
    let scenes = found.first().map_or("", |row| row.scenes.as_str()).replace('+', " and ");
    format!(
        "{pieces}\nof {scenes}; withheld: rows whose leaf area this way withholds, with all their pieces; error, true: standard deviation over the row's mean; RMSE: of the leaf area, raw and drawn toward the row's mean;\nholds: share of the intervals that hold the truth\n\n{bands}\nbands of height that hold leaf: all over the mean band; median: of the error over the band's own truth\n"
    )
}

fn markdown(found: &[PiecesFound]) -> String {
    let plain = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| format!("{:.1}", 100.0 * v));
    let way = |row: &PiecesFound| {
        let r = row.r.map_or_else(|| "–".to_owned(), |r| format!("{r:.2}"));
        let (count, beams) = (row.way.count, row.way.beams);
        let PiecesFound { model, distance_m, piece, pieces, .. } = row;
        format!("| {count}, {beams} | {model} | {distance_m} | {piece} | {pieces} | {r} |")
    };
    let mut text = String::from(
        "| by | model | m | piece | n | r | error | true scatter | reliability | RMSE as measured | RMSE | interval holds | ± |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for row in found.iter().filter(|row| !is_band(row)) {
        text.push_str(&way(row));
        for value in [row.error_sd, row.truth_sd, row.reliability, row.rmse_unshrunk, row.rmse] {
            text.push_str(&format!(" {} |", plain(value)));
        }
        text.push_str(&format!(" {} | {} |\n", plain(row.holds), plain(row.half_width)));
    }
    text.push_str(
        "\n| by | model | m | piece | n | r | median error | RMSE | interval holds | ± |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for row in found.iter().filter(|row| is_band(row)) {
        text.push_str(&way(row));
        for value in [row.median_error, row.rmse, row.holds, row.half_width] {
            text.push_str(&format!(" {} |", plain(value)));
        }
        text.push('\n');
    }
    text
}
