//! Why a pipeline cannot be built.

use rowscan_protocol::rig::RigError;

use crate::calibration::error::CalibrationError;

/// Why a pipeline cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PipelineError {
    /// The rig holds values no estimate could be made with.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The rig has no such scanner.
    #[error("there is no scanner {index}: expected a number below {mounts}, the count of the rig's scanners")]
    NoSuchMount {
        /// The value requested.
        index: usize,
        /// Scanners in the rig.
        mounts: usize,
    },
    /// A value is outside what the estimators are made for.
    #[error("{key} must lie in {low}..={high}, found {value}")]
    OutOfRange {
        /// The rig's or parameter's key.
        key: &'static str,
        /// The value found.
        value: f64,
        /// Smallest value taken.
        low: f64,
        /// Largest value taken.
        high: f64,
    },
    /// Remission of the model grows too little with power to be read.
    #[error(
        "remission of this scanner model does not tell power: expected an LMS, an MRS1000, a picoScan or a multiScan, or a rig.scanner without remission"
    )]
    RemissionTellsNoPower,
    /// A card without readings, or with too many.
    #[error(
        "rig.scanner.remission.readings must have 1 to {most} entries [range_m, remission], found {found}"
    )]
    CardReadings {
        /// The most.
        most: usize,
        /// Given.
        found: usize,
    },
    /// Too few cards to test the law of remission.
    #[error(
        "rig.scanner.remission.others must bring the cards to 3 or more reflectances, the first card's among them, to test how remission goes with power; found {found}"
    )]
    Cards {
        /// Reflectances that differ.
        found: usize,
    },
    /// A card's ranges are not in order.
    #[error("the card's ranges must grow from entry to entry, found {before_m} m before {found_m} m")]
    CardOrder {
        /// A range, metres.
        before_m: f64,
        /// The one after it.
        found_m: f64,
    },
    /// Two passes of one row have voxels of different sizes.
    #[error(
        "the voxels of both passes must have one size to be joined: across, along and up {expected_m:?} m here, {found_m:?} m in the other pass; give both \
         rigs the same tree_spacing_m, row_spacing_m, ground_clearance_m and voxel_edge_m"
    )]
    SidesDiffer {
        /// This pass's edges, metres: across the row, along it, in height.
        expected_m: [f64; 3],
        /// The other's.
        found_m: [f64; 3],
    },
    /// A pipeline without a rig has no voxels.
    #[error("passes from both sides of a row need a rig: it says where the scanner sits")]
    SidesWithoutRig,
    /// The calibration cannot be used.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

impl PipelineError {
    /// Refuses a value outside `low..=high`, NaN included.
    pub(crate) fn check(key: &'static str, value: f64, low: f64, high: f64) -> Result<(), Self> {
        if value >= low && value <= high { Ok(()) } else { Err(Self::OutOfRange { key, value, low, high }) }
    }
}
