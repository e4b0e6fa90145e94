//! Why an orchard cannot be grown.

use crate::import::error::ImportError;
use crate::lsystem::rewrite::Overgrown;
use crate::parameters::ParameterError;
use crate::target::TargetError;

/// Why an orchard cannot be grown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GrowError {
    /// A parameter out of range.
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
    /// A string of an L-system outgrew its bound.
    #[error("tree {tree} of row {row}: {cause}")]
    Overgrown {
        /// Row of the tree.
        row: u32,
        /// Number of the tree.
        tree: u32,
        /// What happened.
        cause: Overgrown,
    },
    /// A file that holds no tree.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// A leaf area that cannot be reached.
    #[error(transparent)]
    Target(#[from] TargetError),
}
