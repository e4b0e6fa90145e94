//! Trees and metres beside their row: how sure each is, and what is the best that can be said of it.
//!
//! The row's mean is often a better estimate of a single tree than the tree's own measurement. So `leaf_area_m2` of a piece is drawn toward the row's mean
//! ([`Reliability`]), what was measured stays beside it as `leaf_area_unshrunk_m2`, and pieces add up to what they added up to before. Windows on the bus stay as
//! measured.

mod reliability;
mod scatter;
mod shrink;
mod told;

pub use reliability::{PieceReliability, Reliability};
pub use scatter::{ByLength, PieceScatter};
pub(crate) use told::{RowSds, tell};
