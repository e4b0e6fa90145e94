//! The paper's scans: six ways to lay beams over a row, and the impacted areas I_L, I_T and I_3L they give.
//!
//! A [`Target`] is what is scanned (a row, or a whole orchard) with its extent; [`ScanSettings`] say how; [`ScanPlan`] is the two
//! together: every line's origin, its beams, and the area each beam stands for. [`ScanPlan::lines`] casts them, all cores at work,
//! and [`ScanPlan::areas`] adds them up. Ranges are exact: no millimetres, no device; what a real scanner would make of a scan is
//! [`crate::optics`]'s business.

mod areas;
mod kind;
mod line_areas;
mod plan;
mod point;
mod target;
mod wood;

pub use areas::{LAYERS, LEAST_INCIDENCE, ScanAreas};
pub use kind::{Sampling, ScanKind};
pub use plan::{CastLine, ScanError, ScanPlan, ScanSettings};
pub use point::ScanPoint;
pub use target::{Extent, Target};
pub use wood::{Casts, Mesh, MeshError, WoodTest};
