//! From scan lines to canopy measures: impacted area, height, volume, leaf area, leaf area index; by row, tree and metre.
//!
//! [`Pipeline`] takes the scans of one scanner, one after the other, and gives an [`Estimate`] at any time. It knows the
//! [`Rig`](rowscan_protocol::rig::Rig) (where the scanner sits, how fast the tractor drives) and nothing else: no scene,
//! no truth, no clock, no I/O. Its result depends only on the sequence of scans, bit for bit.
//!
//! ```
//! use rowscan_canopy::Pipeline;
//! use rowscan_protocol::angle::BeamGrid;
//! use rowscan_protocol::rig::Rig;
//! use rowscan_protocol::scan::{Echo, Scan};
//!
//! let mut pipeline = Pipeline::new(Some(&Rig::default()), 0, None)?;
//! for line in 0..100u16 {
//!     pipeline.push(&Scan {
//!         telegram_counter: line,
//!         scan_time_us: 20_000 * u32::from(line),
//!         scan_frequency_hz: 50.0,
//!         beams: BeamGrid::spanning(-450_000, 2_250_000, 5000),
//!         // Something stands 1.8 m away, whichever way a beam looks.
//!         echoes: vec![Echo { range_m: vec![1.8; 541], remission: Vec::new() }],
//!         ..Scan::default()
//!     });
//! }
//! let estimate = pipeline.finish();
//! assert_eq!((estimate.scans, estimate.scans_lost), (100, Some(0)));
//! assert!(estimate.impacted_total_area_m2 > Some(0.0));
//! # Ok::<(), rowscan_canopy::PipelineError>(())
//! ```
//!
//! Scans come from [`rowscan-driver`](https://docs.rs/rowscan-driver), whose example `estimate_row` feeds this pipeline, or from
//! [`rowscan-recording`](https://docs.rs/rowscan-recording). What [`Pipeline::with_estimators`] can measure besides, [`estimator`] lists.
//!
//! ```text
//! scan -> counting (lost, repeated, restarts; device time) -> advance (y, weight of the line)
//!      -> row: geometry (x, z; ground and far row removed) -> impacted area, profile, voxels: contact frequency, estimators
//!      -> estimate (calibration applied, warnings)
//! ```
//!
//! Memory is bounded and a scan allocates nothing in steady state: per-beam tables are built once per beam grid, only the
//! open slice's voxels are held, and finished trees and slices are a few numbers each, [`Parameters::max_cells`] at most.

mod across;
mod advance;
mod air_witness;
mod answers;
mod beam_line;
mod beam_witness;
mod beside;
mod by_height;
mod by_range;
pub mod calibration;
mod card_law;
mod changed_pairs;
mod class;
mod closing;
mod clumping;
mod clumping_law;
mod contact;
mod cut;
mod delays;
mod deskew;
mod encoder_witness;
mod enough;
mod error;
pub mod estimate;
pub mod estimator;
mod footprint;
mod gate;
mod geometry;
mod ground_line;
mod leaf;
#[cfg(test)]
mod leaf_depth;
mod level;
mod looks;
pub mod odometry;
mod other_side;
mod parameters;
mod patches;
pub mod percentile;
mod picture_speed;
pub mod pieces;
mod placing;
mod profile;
mod ranges;
mod recent;
pub mod reference;
pub mod regression;
mod remission;
mod report;
mod resolutions;
mod row;
mod row_pass;
mod shares;
pub mod shipped;
mod speeds;
mod still_witness;
mod stray_returns;
mod stream;
mod trees;
pub mod uncertainty;
mod voxel_edge;
mod voxels;
mod warning;
pub mod window;

pub use by_height::{BAND_HEIGHTS_M, BandEstimate, HeightProfile, TreeBands};
pub use calibration::{Calibration, CalibrationError, CanopyClass, FitError, Sample, fit};
pub use card_law::CardMisfit;
pub use class::{ClassKey, RowClass, ScanGeometry};
pub use clumping::Clumping;
pub use clumping_law::ClumpingLaw;
pub use cut::{CutMethod, FoundTree, UnknownCut};
pub use enough::{Enough, Reached, UNREADABLE};
pub use error::PipelineError;
pub use estimate::{Estimate, MountReport, Progress, SidesReport, SliceEstimate, TreeEstimate, TreesFound};
pub use estimator::{EstimatorInfo, Measure, Quantity};
pub use footprint::{Footprint, FrontWindow, LeafShape};
pub use gate::{Exclusion, Field};
pub use leaf::{Known, LeafAreas, LeafSlice, LeafWindow, PieceLeaf, RowLeaf, Withheld};
pub use odometry::{AdvanceSource, GroundSpeed};
pub use other_side::{Heading, OtherSide};
pub use parameters::{AreaForm, Fill, Parameters};
pub use placing::{PlacedLine, Placing};
pub use remission::{CardDoubt, Knot, RemissionScale};
pub use stream::Pipeline;
pub use uncertainty::Uncertainty;
pub use voxel_edge::{EdgeBy, LOOKS, Sampling};
pub use voxels::VoxelGrid;
pub use warning::Warning;
