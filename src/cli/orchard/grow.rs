//! `rowscan orchard grow`

use std::path::PathBuf;

use rowscan_scenes::exchange::text::TreeColumn;
use serde::Serialize;

use super::files;
use crate::cli::output;
use crate::cli::scene::SceneArgs;
use crate::cli::{Failure, Format, Outcome};

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Write PREFIX_branches.txt (x1 y1 z1 x2 y2 z2 diameter) and PREFIX_leaves.txt (n x1 y1 z1 … xn yn zn), metres
    #[arg(short, long, value_name = "PREFIX")]
    output: Option<PathBuf>,
    /// How to write the summary
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// What was grown.
#[derive(Debug, Serialize)]
struct Grown {
    scene: String,
    seed: u64,
    trees: usize,
    leaves: usize,
    wood_segments: usize,
    length_m: f64,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let stage = args.scene.stage().await?;
    let orchard = &stage.orchard;
    if let Some(prefix) = &args.output {
        files::write_text(orchard, prefix, TreeColumn::LeftOut)?;
    }
    let grown = Grown {
        scene: args.scene.name.clone(),
        seed: stage.scene.seed,
        trees: orchard.standing().len(),
        leaves: orchard.count(|tree| tree.leaves.len()),
        wood_segments: orchard.count(|tree| tree.wood.len()),
        length_m: orchard.length_m(),
    };
    match args.format {
        Format::Json => output::print_json(args.format, &grown)?,
        format => output::print_rows(format, &[grown])?,
    }
    Ok(Outcome::Done)
}
