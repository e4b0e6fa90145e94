//! `rowscan orchard truth`

use super::truth_cells::{self, CellArgs};
use crate::cli::grid::Grid;
use crate::cli::output::{self, number};
use crate::cli::scene::SceneArgs;
use crate::cli::{Failure, Format, Outcome};
use rowscan_scenes::TruthGrid;

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// The row, from 0
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "cells")]
    row: usize,
    /// Instead, the areas by cell along the row, height band and tree, of all rows
    #[arg(long)]
    cells: bool,
    #[command(flatten)]
    of_cells: CellArgs,
    /// How to write the truth
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let stage = args.scene.stage().await?;
    if args.cells {
        return truth_cells::run(&args.of_cells, args.format, stage).await;
    }
    let rows = stage.orchard.rows();
    if args.row >= rows {
        let found = args.row;
        return Err(Failure::Usage(format!("there is no row {found}: the orchard has {rows}, from 0 on")));
    }
    let truth = stage.orchard.truth_of_row(args.row, TruthGrid::default());
    match args.format {
        Format::Json | Format::Jsonl => output::print_json(args.format, &truth)?,
        Format::Csv => output::print_rows(args.format, &truth.trees)?,
        Format::Table => {
            let mut table = Grid::new();
            output::head(
                &mut table,
                ["tree", "y m", "leaves", "leaf area m²", "wood area m²", "LAI", "height m"],
            );
            for tree in &truth.trees {
                table.add_row([
                    number(Some(f64::from(tree.tree)), 0),
                    number(tree.y_m, 2),
                    number(Some(tree.leaves as f64), 0),
                    number(Some(tree.leaf_area_m2), 3),
                    number(Some(tree.wood_area_m2), 3),
                    number(tree.lai, 2),
                    number(Some(tree.height_m), 2),
                ]);
            }
            output::print(&format!("{table}\n"))?;
            let lai = truth.lai.map_or_else(|| "unknown".to_owned(), |lai| format!("{lai:.2}"));
            output::print(&format!(
                "row {} of {rows}, seed {}: leaf area {:.3} m², wood area {:.3} m², LAI {lai}\n",
                args.row, stage.scene.seed, truth.leaf_area_m2, truth.wood_area_m2
            ))?;
            if let Some((mean, sd)) = truth.leaf_angle_mean_deg.zip(truth.leaf_angle_sd_deg) {
                output::print(&format!("leaf inclination {mean:.1}° ± {sd:.1}° from the horizontal\n"))?;
            }
            if truth.post_area_m2 + truth.wire_area_m2 > 0.0 {
                output::print(&format!(
                    "posts {:.3} m², wires {:.3} m²\n",
                    truth.post_area_m2, truth.wire_area_m2
                ))?;
            }
            if let Some(adjustment) = &truth.adjustment {
                output::print(&format!(
                    "of all rows: LAI {:.3} asked for, {:.3} grown, {:.3} reached: {} leaves thinned out, {} added\n",
                    adjustment.target_lai,
                    adjustment.grown_lai,
                    adjustment.reached_lai,
                    adjustment.leaves_thinned,
                    adjustment.leaves_seeded
                ))?;
            }
        }
    }
    Ok(Outcome::Done)
}
