//! What every generator is given, and what it must do.

use super::draft::Draft;
use super::error::GrowError;
use super::remark::Remark;

/// One place of an orchard, or one of the distinct trees that stand in many.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Planting {
    /// Row, part of the tree's seed.
    pub(crate) row: u32,
    /// Number of the tree, part of its seed.
    pub(crate) tree: u32,
    /// Nothing grows here.
    pub(crate) gap: bool,
    /// A replanted tree, younger than the others.
    pub(crate) is_young: bool,
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
