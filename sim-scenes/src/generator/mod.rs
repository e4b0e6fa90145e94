//! What makes the trees of an orchard.
//!
//! A generator turns a place of the orchard into a draft: branches and leaves with what bears them. What follows is the
//! same for all of them (`plant`): shade, shears, season, target leaf area. A new generator is one file with `impl Generator`, a name
//! in [`GeneratorKind`] and its line in `make`.

pub(crate) mod draft;
mod error;
pub(crate) mod plant;
mod remark;

pub use error::GrowError;
pub use remark::Remark;

use crate::analytic::Analytic;
use crate::growth::Hmt;
use crate::import::Imported;
use crate::lsystem::Sprouting;
use crate::orchard::OrchardParameters;
use crate::parameters::choices;
use draft::Draft;

choices! {
    /// What makes the trees.
    pub enum GeneratorKind {
        /// Hidden Markov trees after Méndez et al. (2013): `[orchard.tree]`.
        Hmt = "hmt",
        /// A bracketed L-system drawn by a turtle: `[orchard.lsystem]`; leaf, shade and shears of `[orchard.tree]`.
        LSystem = "lsystem",
        /// Trees from files, text or mesh: `[orchard.import]`.
        Import = "import",
        /// A scene whose answer is a formula: `[orchard.analytic]`.
        Analytic = "analytic",
    }
}

/// One place of an orchard, or one of the distinct trees that stand in many.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Planting {
    /// Row, part of the tree's seed.
    pub(crate) row: u32,
    /// Number of the tree, part of its seed.
    pub(crate) tree: u32,
    /// Nothing grows here.
    pub(crate) gap: bool,
    /// Foot of the trunk, scene frame.
    pub(crate) base: [f64; 3],
}

/// Makes trees, one a call, in any order and on any thread.
pub(crate) trait Generator: Sync {
    /// One tree. What is random in it follows from the seed and the planting's row and number alone.
    fn draft(&self, planting: &Planting) -> Result<Draft, GrowError>;

    /// True if drafts stand where they belong; else at the origin, and are moved to their places.
    fn is_placed(&self) -> bool {
        false
    }

    /// True if its trees are pruned to the envelope where the parameters ask for it.
    fn is_pruned(&self) -> bool {
        false
    }

    /// What the user should know of the input.
    fn remarks(&self) -> Vec<Remark> {
        Vec::new()
    }
}

/// The generator that the parameters name.
pub(crate) fn make(parameters: &OrchardParameters, seed: u64) -> Result<Box<dyn Generator + '_>, GrowError> {
    Ok(match parameters.generator {
        GeneratorKind::Hmt => Box::new(Hmt::new(parameters.tree_parameters(), seed)?),
        GeneratorKind::LSystem => Box::new(Sprouting::new(parameters, seed)?),
        GeneratorKind::Import => Box::new(Imported::new(parameters)?),
        GeneratorKind::Analytic => Box::new(Analytic::new(parameters, seed)?),
    })
}
