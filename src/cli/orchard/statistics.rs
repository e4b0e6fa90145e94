//! `rowscan orchard statistics`

use rayon::prelude::*;
use rowscan_scenes::files;
use rowscan_scenes::{GrowError, Orchard, Scene, TreeTruth, builtin};
use serde::Serialize;

use crate::cli::blocking::off_runtime;
use crate::cli::study::rows::Seeds;
use crate::cli::{Failure, Format, Outcome, output, progress};

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Scene files, or names of built-in scenes; all built-in scenes where none is given
    #[arg(value_name = "SCENE")]
    scenes: Vec<String>,
    /// Seeds, one orchard each
    #[arg(long, value_name = "FIRST..LAST", default_value = "1..20")]
    seeds: Seeds,
    /// Write the table as Markdown, as docs/orchards.md has it
    #[arg(long)]
    markdown: bool,
    /// How to write the table
    #[arg(long, value_enum, default_value_t, conflicts_with = "markdown")]
    format: Format,
}

/// The trees of one scene over all seeds.
#[derive(Debug, Serialize)]
struct Row {
    scene: String,
    seeds: usize,
    trees: usize,
    leaves_mean: f64,
    leaf_area_mean_m2: f64,
    /// Standard deviation between trees over the mean.
    leaf_area_cv: Option<f64>,
    wood_area_mean_m2: f64,
    height_mean_m: f64,
    height_sd_m: f64,
    lai_mean: Option<f64>,
    leaf_angle_mean_deg: Option<f64>,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let names = match args.scenes.is_empty() {
        true => builtin::names().map(str::to_owned).collect(),
        false => args.scenes,
    };
    let scenes = names.into_iter().map(|name| Ok((files::load_scene(&name)?, name)));
    let scenes = scenes.collect::<Result<Vec<(Scene, String)>, Failure>>()?;
    let seeds = args.seeds.0;
    let bar = progress::bar("growing", "orchards", (scenes.len() * seeds.len()) as u64);
    let rows = off_runtime("grow the orchards", move || -> Result<Vec<Row>, GrowError> {
        let rows = scenes.iter().map(|(scene, name)| row(scene, name, &seeds, &|| bar.inc(1))).collect();
        bar.finish_and_clear();
        rows
    })
    .await?;
    if args.markdown {
        output::print(&markdown(&rows))?
    } else {
        output::print_rows(args.format, &rows)?
    }
    Ok(Outcome::Done)
}

fn row(scene: &Scene, name: &str, seeds: &[u64], done: &(dyn Fn() + Sync)) -> Result<Row, GrowError> {
    let truths = seeds
        .par_iter()
        .map(|seed| {
            let truth = Orchard::grow(&scene.orchard, *seed, &|_, _| {})?.truth();
            done();
            Ok(truth)
        })
        .collect::<Vec<Result<_, GrowError>>>();
    // In order, so that of several errors it is always the same one that is told.
    let truths = truths.into_iter().collect::<Result<Vec<_>, _>>()?;
    let trees: Vec<&TreeTruth> = truths.iter().flat_map(|truth| &truth.trees).collect();
    let over = |of: &dyn Fn(&TreeTruth) -> f64| {
        let count = trees.len().max(1) as f64;
        let mean = trees.iter().map(|tree| of(tree)).sum::<f64>() / count;
        let squares = trees.iter().map(|tree| (of(tree) - mean) * (of(tree) - mean)).sum::<f64>();
        (mean, (squares / (count - 1.0).max(1.0)).sqrt())
    };
    let mean_of = |values: Option<Vec<f64>>| {
        values
            .filter(|values| !values.is_empty())
            .map(|values| values.iter().sum::<f64>() / values.len() as f64)
    };
    let (leaf_area_mean_m2, leaf_area_sd_m2) = over(&|tree| tree.leaf_area_m2);
    let (height_mean_m, height_sd_m) = over(&|tree| tree.height_m);
    Ok(Row {
        scene: name.to_owned(),
        seeds: seeds.len(),
        trees: trees.len(),
        leaves_mean: over(&|tree| tree.leaves as f64).0,
        leaf_area_mean_m2,
        leaf_area_cv: (leaf_area_mean_m2 > 0.0).then(|| leaf_area_sd_m2 / leaf_area_mean_m2),
        wood_area_mean_m2: over(&|tree| tree.wood_area_m2).0,
        height_mean_m,
        height_sd_m,
        lai_mean: mean_of(truths.iter().map(|truth| truth.lai).collect()),
        leaf_angle_mean_deg: mean_of(truths.iter().map(|truth| truth.leaf_angle_mean_deg).collect()),
    })
}

fn markdown(rows: &[Row]) -> String {
    let mut text = String::from(
        "| scene | trees | leaves a tree | leaf area m² | CV | wood m² | height m | LAI | leaf angle ° |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    let written =
        |value: Option<f64>, digits: usize| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"));
    for row in rows {
        text.push_str(&format!(
            "| {} | {} | {:.0} | {:.2} | {} | {:.2} | {:.2} ± {:.2} | {} | {} |\n",
            row.scene,
            row.trees,
            row.leaves_mean,
            row.leaf_area_mean_m2,
            written(row.leaf_area_cv, 2),
            row.wood_area_mean_m2,
            row.height_mean_m,
            row.height_sd_m,
            written(row.lai_mean, 2),
            written(row.leaf_angle_mean_deg, 0)
        ));
    }
    text
}
