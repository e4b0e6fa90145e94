//! How much the measured differences between the pieces of a row say.

use serde::Serialize;

/// How much the differences between a row's trees and metres say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PieceReliability {
    /// Of its trees.
    pub trees: Option<Reliability>,
    /// Of its metres.
    pub metres: Option<Reliability>,
}

/// How much the measured differences between pieces of a row say of true ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reliability {
    /// Pieces drawn toward the row's mean: all that hold foliage.
    pub pieces: u32,
    /// Share of the pieces' variance that is true, 0 to 1: what a difference from the mean is multiplied by.
    pub reliability: f64,
    /// Standard deviation of a whole piece's error, over the row's mean; by the pieces study.
    pub error_relative_sd: f64,
    /// Standard deviation of the true differences, over the row's mean; of this row.
    pub truth_relative_sd: f64,
}
