//! `rowscan orchard`: make, measure, read and write orchards.

mod export;
mod files;
mod grow;
mod import;
mod parameters;
mod render;
mod statistics;
mod truth;
mod truth_cells;

use super::interrupt::Interrupt;
use super::{Failure, Outcome};

#[derive(Debug, clap::Subcommand)]
pub(super) enum Command {
    /// Grow an orchard; write its branches and leaves
    Grow(grow::Args),
    /// Measure the leaf and wood area that is really there
    Truth(truth::Args),
    /// Read trees from files, say what is in them, and write them in other formats
    Import(import::Args),
    /// Write an orchard as text, OBJ, PLY or glTF, or draw it as SVG
    Export(export::Args),
    /// Draw a shaded picture as PNG: leaves, wood, posts, wires, fruit and ground in sunlight
    Render(render::Args),
    /// Leaf area, wood and height over many seeds
    Statistics(statistics::Args),
    /// List every parameter of an orchard with its value, its unit and the reason for its default
    Parameters(parameters::Args),
}

pub(super) async fn run(command: Command, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    let work = async {
        match command {
            Command::Grow(args) => grow::run(args).await,
            Command::Truth(args) => truth::run(args).await,
            Command::Import(args) => import::run(args).await,
            Command::Export(args) => export::run(args).await,
            Command::Render(args) => render::run(args).await,
            Command::Statistics(args) => statistics::run(args).await,
            Command::Parameters(args) => parameters::run(&args),
        }
    };
    interrupt.finite(work).await
}
