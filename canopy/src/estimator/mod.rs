//! The estimators: one file each, one line each in [`TABLE`]; the same on simulated and on recorded scans.
//!
//! An estimator takes what the row hands out, in this order, and keeps sums of it: every `Line` with what each beam came to; a
//! `Section` about every 0.1 m (the crown's outline); a `Slice` about every 0.25 m (the voxels). Its memory is bounded and a line
//! allocates nothing. `Estimator::measures` turns the sums into numbers, for the row and for every tree: the row's set runs
//! through, the trees' is emptied at every border.

mod bands;
mod contract;
mod gap;
mod height;
mod impacted;
mod lwa;
pub(crate) mod measure;
mod occlusion;
mod polar;
mod polar_cells;
mod porosity;
mod read;
mod reported;
mod set;
mod table;
mod tai;
mod trv;
mod volume;
mod voxel;
mod width;

pub use contract::EstimatorInfo;
pub(crate) use contract::{Contact, Setting, SightedLine, Sighting, Slice, Stretch};
pub use measure::{Measure, Quantity};
pub use read::name_of;
pub use reported::REPORTED;
pub(crate) use set::Estimators;
pub use table::{TABLE, by_name};
