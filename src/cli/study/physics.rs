//! `rowscan study physics`: what a real beam does to the measures, one stage at a time.

use std::path::PathBuf;

use comfy_table::Cell;
use rowscan_protocol::model::AnyModel;
use rowscan_scenes::files;

use super::keep::KeepArgs;
use super::rows::{Seeds, distances_m};
use crate::cli::blocking::off_runtime;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, percent, say};
use crate::cli::{Failure, Format, Outcome, models, progress};
use rowscan_study::figure;
use rowscan_study::physics::{Effect, Output, Physics, ladder, physics};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// A scene file, or the name of a built-in scene
    #[arg(value_name = "SCENE", default_value = "spindle")]
    scene: String,
    /// Seeds of the rows, first..last
    #[arg(long, value_name = "A..B", default_value = "201..202")]
    seeds: Seeds,
    /// Scanner models
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = models::name(), hide_possible_values = true, default_value = "lms111,lms511,tim561,lms291")]
    model: Vec<String>,
    /// Distances from the mirror to the row plane, metres
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1,2,4")]
    distance: Vec<f64>,
    /// Draw the figure: an SVG file
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<PathBuf>,
    /// Write the tables as docs/measurements/eye.md holds them
    #[arg(long, conflicts_with = "format")]
    markdown: bool,
    #[command(flatten)]
    keep: KeepArgs,
    /// How to write the table; CSV, JSON and JSON lines hold a row an output
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let scene = files::load_scene(&args.scene, say)?;
    args.figure.as_deref().map_or(Ok(()), output::can_be_written)?;
    let distances_m = distances_m(&args.distance)?;
    let models: Vec<AnyModel> = args.model.iter().map(|name| models::find(name)).collect::<Result<_, _>>()?;
    let asked = Physics { scene, seeds: args.seeds.0.clone(), models, distances_m };
    let tries = asked.seeds.len() * asked.models.len() * asked.distances_m.len();
    let bar = progress::bar("driving past", "rows", tries as u64);
    let kept = args.keep.open()?;
    let work = move || {
        let effects = physics(&asked, &kept.archive, &|| bar.inc(1));
        bar.finish_and_clear();
        kept.tell();
        effects
    };
    let effects = off_runtime("try the stages", work).await?;
    if let Some(path) = &args.figure {
        output::write_file(path, &figure::physics(&effects))?;
        say(format_args!("wrote {}", path.display()));
    }
    match args.format {
        _ if args.markdown => output::print(&markdown(&effects))?,
        Format::Json => output::print_json(args.format, &effects)?,
        Format::Jsonl | Format::Csv => output::print_rows(args.format, &effects)?,
        Format::Table => output::print(&table(&effects))?,
    }
    Ok(Outcome::Done)
}

/// The places that stand in the effects, each once, in their order.
fn places(effects: &[Effect]) -> Vec<(&'static str, f64)> {
    let mut places: Vec<(&'static str, f64)> = Vec::new();
    for effect in effects {
        let place = (effect.model, effect.distance_m);
        if !places.contains(&place) {
            places.push(place);
        }
    }
    places
}

/// One effect.
fn find<'a>(
    effects: &'a [Effect],
    (model, distance_m): (&str, f64),
    stages: &str,
    output: Output,
) -> Option<&'a Effect> {
    effects.iter().find(|effect| {
        effect.model == model
            && effect.distance_m == distance_m
            && effect.stages == stages
            && effect.output == output
    })
}

fn table(effects: &[Effect]) -> String {
    let mut grid = Grid::new();
    let heads = ["model", "m", "stages"].into_iter().chain(Output::ALL.into_iter().map(Output::name));
    output::head(&mut grid, heads.collect::<Vec<_>>());
    for place in places(effects) {
        for (rung, stages) in ladder().iter().map(ToString::to_string).enumerate() {
            let of = |output: Output| {
                let effect = find(effects, place, &stages, output);
                match rung {
                    0 => number(effect.filter(|effect| effect.n > 0).map(|effect| effect.mean), 2),
                    _ => percent(effect.and_then(|effect| effect.change)),
                }
            };
            let head = [Cell::new(place.0), number(Some(place.1), 1), Cell::new(&stages)];
            grid.add_row(head.into_iter().chain(Output::ALL.into_iter().map(of)));
        }
        let of = |output: Output| percent(find(effects, place, "device", output).and_then(|e| e.error));
        let head = [Cell::new(place.0), number(Some(place.1), 1), Cell::new("device − truth")];
        grid.add_row(head.into_iter().chain(Output::ALL.into_iter().map(of)));
    }
    format!(
        "{grid}\nideal: as measured (m, m², m³, /ha); stages: change against it; contact and gap with the spot left in\n"
    )
}

fn markdown(effects: &[Effect]) -> String {
    let percent = |fraction: Option<f64>| {
        fraction.map_or_else(String::new, |fraction| format!("{:+.1}", 100.0 * fraction))
    };
    let mut text = String::from("| model | m | stages |");
    for output in Output::ALL {
        text.push_str(&format!(" {} |", output.name()));
    }
    text.push_str("\n|---|---|---|");
    text.push_str(&"---|".repeat(Output::ALL.len()));
    text.push('\n');
    for place in places(effects) {
        let mut row = |label: &str, of: &dyn Fn(Output) -> String| {
            text.push_str(&format!("| {} | {} | {label} |", place.0, place.1));
            for output in Output::ALL {
                text.push_str(&format!(" {} |", of(output)));
            }
            text.push('\n');
        };
        for (rung, stages) in ladder().iter().map(ToString::to_string).enumerate() {
            let effect = |output| find(effects, place, &stages, output);
            match rung {
                0 => row(&stages, &|output| {
                    let known = effect(output).filter(|effect| effect.n > 0);
                    known.map_or_else(String::new, |effect| format!("{:.2}", effect.mean))
                }),
                _ => row(&stages, &|output| percent(effect(output).and_then(|effect| effect.change))),
            }
        }
        row("device − truth", &|output| {
            percent(find(effects, place, "device", output).and_then(|e| e.error))
        });
    }
    text
}
