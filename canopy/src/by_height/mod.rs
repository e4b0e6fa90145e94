//! The canopy by height: leaf area, density, gaps and porosity of bands from the ground up, of the row and of each tree.
//!
//! Only made where it is asked for ([`Pipeline::with_profile`](crate::Pipeline::with_profile)). Leaf areas are those of the voxels, shared out to bands; so bands of a
//! stretch add up to its leaf area, by the same law. Gaps are counted by passages of beams, which voxels do not keep.
//!
//! ```text
//! lines  -> OpenSlice: passages, hits and impacted area by band and column
//! slices -> ByHeight: sums of the row, of each tree, and of blocks of the row
//! report -> HeightProfile: leaf areas by the row's law, intervals by its blocks
//! ```

mod band_sums;
mod blocks;
mod ladder;
mod open;
mod report;
mod sums;
mod told;
mod unsure;

pub use ladder::BAND_HEIGHTS_M;
pub(crate) use report::tell;
pub(crate) use sums::ByHeight;
pub use told::{BandEstimate, HeightProfile, TreeBands};
