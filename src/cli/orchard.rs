//! `rowscan orchard`

use std::fmt::Write as _;
use std::path::PathBuf;

use rowscan_scenes::Orchard;
use serde::Serialize;

use super::interrupt::Interrupt;
use super::output::{self, number, say};
use super::scene::SceneArgs;
use super::{Failure, Format, Outcome};

#[derive(Debug, clap::Subcommand)]
pub(super) enum Command {
    /// Grow an orchard; write its branches and leaves
    Grow(GrowArgs),
    /// Measure the leaf and wood area that is really there
    Truth(TruthArgs),
}

#[derive(Debug, clap::Args)]
pub(super) struct GrowArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Write PREFIX_branches.txt (x1 y1 z1 x2 y2 z2 diameter) and PREFIX_leaves.txt (n x1 y1 z1 … xn yn zn), metres
    #[arg(short, long, value_name = "PREFIX")]
    output: Option<PathBuf>,
    /// How to write the summary
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

#[derive(Debug, clap::Args)]
pub(super) struct TruthArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// How to write the truth
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

pub(super) async fn run(command: Command) -> Result<Outcome, Failure> {
    let mut interrupt = Interrupt::watch()?;
    let work = async {
        match command {
            Command::Grow(args) => grow(args).await,
            Command::Truth(args) => truth(args).await,
        }
    };
    interrupt.or(work).await.unwrap_or(Ok(Outcome::Done))
}

async fn grow(args: GrowArgs) -> Result<Outcome, Failure> {
    let stage = args.scene.stage().await?;
    let orchard = &stage.orchard;
    if let Some(prefix) = &args.output {
        let named = |part: &str| {
            let mut name = prefix.clone().into_os_string();
            name.push(part);
            PathBuf::from(name)
        };
        output::write_file(&named("_branches.txt"), &branches(orchard))?;
        output::write_file(&named("_leaves.txt"), &leaves(orchard))?;
        say(format_args!("wrote {}_branches.txt and {0}_leaves.txt", prefix.display()));
    }
    let grown = Grown {
        scene: args.scene.name,
        seed: stage.scene.seed,
        trees: orchard.trees().len(),
        leaves: orchard.trees().iter().map(|tree| tree.leaves.len()).sum(),
        wood_segments: orchard.trees().iter().map(|tree| tree.wood.len()).sum(),
        length_m: orchard.length_m(),
    };
    match args.format {
        Format::Json => output::print_json(args.format, &grown)?,
        format => output::print_rows(format, &[grown])?,
    }
    Ok(Outcome::Done)
}

/// One branch segment a line. Rust prints the shortest digits that read back to the same number.
fn branches(orchard: &Orchard) -> String {
    let mut text = String::from("# x1 y1 z1 x2 y2 z2 diameter (m)\n");
    for piece in orchard.trees().iter().flat_map(|tree| &tree.wood) {
        let ([x1, y1, z1], [x2, y2, z2]) = (piece.base(), piece.tip());
        let _ = writeln!(text, "{x1} {y1} {z1} {x2} {y2} {z2} {}", 2.0 * piece.radius_m());
    }
    text
}

/// One leaf a line.
fn leaves(orchard: &Orchard) -> String {
    let mut text = String::from("# n x1 y1 z1 ... xn yn zn (m)\n");
    for leaf in orchard.trees().iter().flat_map(|tree| &tree.leaves) {
        let _ = write!(text, "{}", leaf.outline().len());
        for [x, y, z] in leaf.outline() {
            let _ = write!(text, " {x} {y} {z}");
        }
        text.push('\n');
    }
    text
}

async fn truth(args: TruthArgs) -> Result<Outcome, Failure> {
    let stage = args.scene.stage().await?;
    let truth = stage.orchard.truth();
    match args.format {
        Format::Json | Format::Jsonl => output::print_json(args.format, &truth)?,
        Format::Csv => output::print_rows(args.format, &truth.trees)?,
        Format::Table => {
            let mut table = output::grid();
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
                "seed {}: leaf area {:.3} m², wood area {:.3} m², LAI {lai}\n",
                stage.scene.seed, truth.leaf_area_m2, truth.wood_area_m2
            ))?;
        }
    }
    Ok(Outcome::Done)
}
