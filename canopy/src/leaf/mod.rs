//! Leaf area: made in one place, for a row, a tree, a metre and a window on the bus alike, or withheld with its reason.
//!
//! ```text
//! sums of the row so far + calibration -> Law -> LeafAreas of any stretch of it
//! ```
//!
//! A [`LeafAreas`] holds each number as a `Result`: who prints it cannot reach one that is withheld.

mod areas;
pub(crate) mod by_outline;
mod count;
mod counted;
mod estimator;
mod law;
mod leafy;
mod piece_leaf;
mod row_leaf;
mod slices;
mod sums;
mod window;
mod withheld;

pub use areas::{Known, LeafAreas};
pub(crate) use count::Count;
pub use estimator::LeafAreaEstimator;
pub(crate) use law::{Law, RangedAreas};
pub(crate) use leafy::Leafy;
pub use piece_leaf::PieceLeaf;
pub use row_leaf::RowLeaf;
pub(crate) use slices::{SliceLeaf, Slices, by_band};
pub(crate) use sums::Sums;
pub use window::{LeafSlice, LeafWindow};
pub use withheld::Withheld;
