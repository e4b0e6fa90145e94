//! `rowscan orchard statistics`

use rayon::prelude::*;
use rowscan_scenes::files;
use rowscan_scenes::{CanopyForm, FoliageShares, GrowError, Orchard, Scene, TreeTruth, Truth, builtin};
use serde::Serialize;

use crate::cli::blocking::off_runtime;
use crate::cli::output::{self, say};
use crate::cli::study::rows::Seeds;
use crate::cli::{Failure, Format, Outcome, progress};

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

/// The trees of the first row of one scene over all seeds.
#[derive(Debug, Serialize)]
struct Row {
    scene: String,
    seeds: usize,
    trees: usize,
    leaves_mean: Option<f64>,
    leaf_area_mean_m2: Option<f64>,
    /// Standard deviation between trees over the mean.
    leaf_area_cv: Option<f64>,
    wood_area_mean_m2: Option<f64>,
    height_mean_m: Option<f64>,
    height_sd_m: Option<f64>,
    lai_mean: Option<f64>,
    leaf_angle_mean_deg: Option<f64>,
    /// Extent of the leaves across the row.
    width_mean_m: Option<f64>,
    /// Lowest leaf.
    clear_mean_m: Option<f64>,
    /// Leaf area over the volume of the crowns.
    leaf_area_density_mean_m2_m3: Option<f64>,
    /// G(0°): leaf area seen square to the row, over leaf area.
    projection_mean: Option<f64>,
    /// Share of level lines across the row that pass.
    gap_fraction_mean: Option<f64>,
    /// Share of the leaf area on wood that did not grow in the season.
    older_wood_share_mean: Option<f64>,
    /// Share of the leaf area in rosettes of spurs.
    spur_share_mean: Option<f64>,
}

/// What one orchard gives.
struct Measured {
    truth: Truth,
    form: Option<CanopyForm>,
    foliage: Option<FoliageShares>,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let names = match args.scenes.is_empty() {
        true => builtin::names().map(str::to_owned).collect(),
        false => args.scenes,
    };
    let scenes = names.into_iter().map(|name| Ok((files::load_scene(&name, say)?, name)));
    let scenes = scenes.collect::<Result<Vec<(Scene, String)>, Failure>>()?;
    for (scene, name) in &scenes {
        let rows = scene.orchard.layout().rows;
        if rows > 1 {
            say(format_args!("{name}: of its {rows} rows the first one alone"));
        }
    }
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
    let measured = seeds
        .par_iter()
        .map(|seed| {
            let orchard = Orchard::grow(&scene.orchard, *seed, &|_, _| {})?;
            let form = CanopyForm::of_row(&orchard, 0);
            done();
            Ok(Measured { truth: orchard.truth(), form, foliage: orchard.foliage() })
        })
        .collect::<Vec<Result<_, GrowError>>>();
    // In order, so that of several errors it is always the same one that is told.
    let measured = measured.into_iter().collect::<Result<Vec<_>, _>>()?;
    // A place where none stands is no tree.
    let standing = |tree: &&TreeTruth| tree.height_m > 0.0;
    let trees: Vec<&TreeTruth> =
        measured.iter().flat_map(|orchard| &orchard.truth.trees).filter(standing).collect();
    let mean_over = |of: &dyn Fn(&TreeTruth) -> f64| {
        (!trees.is_empty()).then(|| trees.iter().map(|tree| of(tree)).sum::<f64>() / trees.len() as f64)
    };
    // One tree alone has no scatter.
    let sd_over = |of: &dyn Fn(&TreeTruth) -> f64| {
        let mean = mean_over(of).filter(|_| trees.len() > 1)?;
        let squares = trees.iter().map(|tree| (of(tree) - mean) * (of(tree) - mean)).sum::<f64>();
        Some((squares / (trees.len() as f64 - 1.0)).sqrt())
    };
    // Unknown in one orchard is unknown of all.
    let mean_of = |of: &dyn Fn(&Measured) -> Option<f64>| {
        let values: Option<Vec<f64>> = measured.iter().map(of).collect();
        values
            .filter(|values| !values.is_empty())
            .map(|values| values.iter().sum::<f64>() / values.len() as f64)
    };
    let of_form = |of: fn(&CanopyForm) -> f64| mean_of(&|orchard| orchard.form.as_ref().map(of));
    let leaf_area_mean_m2 = mean_over(&|tree| tree.leaf_area_m2);
    let leaf_area_sd_m2 = sd_over(&|tree| tree.leaf_area_m2);
    Ok(Row {
        scene: name.to_owned(),
        seeds: seeds.len(),
        trees: trees.len(),
        leaves_mean: mean_over(&|tree| tree.leaves as f64),
        leaf_area_mean_m2,
        leaf_area_cv: leaf_area_mean_m2
            .zip(leaf_area_sd_m2)
            .filter(|(mean_m2, _)| *mean_m2 > 0.0)
            .map(|(mean_m2, sd_m2)| sd_m2 / mean_m2),
        wood_area_mean_m2: mean_over(&|tree| tree.wood_area_m2),
        height_mean_m: mean_over(&|tree| tree.height_m),
        height_sd_m: sd_over(&|tree| tree.height_m),
        lai_mean: mean_of(&|orchard| orchard.truth.lai),
        leaf_angle_mean_deg: mean_of(&|orchard| orchard.truth.leaf_angle_mean_deg),
        width_mean_m: of_form(|form| form.width_m),
        clear_mean_m: of_form(|form| form.clear_m),
        leaf_area_density_mean_m2_m3: of_form(|form| form.leaf_area_density_m2_m3),
        projection_mean: of_form(|form| form.projection),
        gap_fraction_mean: of_form(|form| form.gap_fraction),
        older_wood_share_mean: mean_of(&|orchard| orchard.foliage.map(|foliage| foliage.older_share)),
        spur_share_mean: mean_of(&|orchard| orchard.foliage.map(|foliage| foliage.spur_share)),
    })
}

fn markdown(rows: &[Row]) -> String {
    let mut text = String::from(
        "| scene | trees | leaves a tree | leaf area m² | CV | wood m² | height m | LAI | leaf angle ° | width m | lowest leaf m | leaf area density m²/m³ | G(0°) | gap fraction | on older wood | in rosettes |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let written =
        |value: Option<f64>, digits: usize| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"));
    for row in rows {
        text.push_str(&format!(
            "| {} | {} | {} | {} | {} | {} | {} ± {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n",
            row.scene,
            row.trees,
            written(row.leaves_mean, 0),
            written(row.leaf_area_mean_m2, 2),
            written(row.leaf_area_cv, 2),
            written(row.wood_area_mean_m2, 2),
            written(row.height_mean_m, 2),
            written(row.height_sd_m, 2),
            written(row.lai_mean, 2),
            written(row.leaf_angle_mean_deg, 0),
            written(row.width_mean_m, 2),
            written(row.clear_mean_m, 2),
            written(row.leaf_area_density_mean_m2_m3, 1),
            written(row.projection_mean, 2),
            written(row.gap_fraction_mean, 2),
            written(row.older_wood_share_mean, 2),
            written(row.spur_share_mean, 2)
        ));
    }
    text
}
