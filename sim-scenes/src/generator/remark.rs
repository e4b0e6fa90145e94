//! What was done to the input that the user did not ask for word by word.

use std::fmt;

use crate::growth::markov::State;

/// How many times the leaf area index that grows may be asked for without a word.
pub(crate) const MOST_COPIES: f64 = 3.0;

/// Rows of fewer distinct trees are told: their mean is off by what single trees are off by.
pub(crate) const FEWEST_TREES: u32 = 8;

/// Something to tell the user about an orchard.
#[derive(Clone, Debug, PartialEq)]
pub enum Remark {
    /// A row of a matrix was divided by its sum, as asked.
    Renormalised {
        /// The key it stands at.
        key: &'static str,
        /// Parent state of the row.
        row: State,
        /// What it summed to.
        sum: f64,
    },
    /// Leaves that are not plane were cut into triangles.
    NotPlane {
        /// The file.
        path: String,
        /// How many.
        leaves: usize,
        /// Line, or number, of the first.
        first: usize,
        /// How far it is off its plane, over its size.
        warp: f64,
    },
    /// Most leaves are copies of the tree's own.
    Copies {
        /// Leaf area index asked for.
        target_lai: f64,
        /// Of the orchard as it grew.
        grown_lai: f64,
    },
    /// The trees of all rows are copies of a few.
    FewTrees {
        /// How many differ.
        distinct_trees: u32,
    },
    /// Leaves with the corners of another one were left out: back faces.
    Twice {
        /// The file.
        path: String,
        /// How many.
        leaves: usize,
        /// Line, or number, of the first.
        first: usize,
    },
    /// Faces without area were left out.
    NoArea {
        /// The file.
        path: String,
        /// How many.
        faces: usize,
        /// Line, or number, of the first.
        first: usize,
    },
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Renormalised { key, row, sum } => {
                write!(f, "orchard.tree.{key}: row {row} sums to {sum} and was divided by that")
            }
            Self::NotPlane { path, leaves, first, warp } => write!(
                f,
                "{path}: {leaves} leaves are not plane and were cut into triangles; the first at {first}, off by {warp:.3} of its size"
            ),
            Self::Copies { target_lai, grown_lai } => write!(
                f,
                "orchard.target_lai: expected at most {MOST_COPIES} times what grows, {grown_lai:.2}, found {target_lai}: most leaves are copies, on the same thin wood and on added shoots, closer together than trees have them, and estimates of such rows may be half the truth, outside of their interval; lower it, or take larger trees (another preset; of `hmt` more `tree.iterations`)"
            ),
            Self::FewTrees { distinct_trees } => write!(
                f,
                "orchard.distinct_trees: expected {FEWEST_TREES} or more, or 0, found {distinct_trees}: rows of copies differ from their calibration by as much as single trees do, 8 to 12 %, and look even: estimates of such rows may lie outside of their interval"
            ),
            Self::Twice { path, leaves, first } => write!(
                f,
                "{path}: {leaves} leaves have the corners of another one, as back faces have, and were left out: leaf areas are one-sided; the first at {first}"
            ),
            Self::NoArea { path, faces, first } => {
                write!(f, "{path}: {faces} faces without area were left out; the first at {first}")
            }
        }
    }
}
