//! The paper's scans: six ways to lay beams over a row, and the impacted areas I_L, I_T and I_3L they give.
//!
//! A [`Target`] is what is scanned (a row, or a whole orchard) with its extent; [`ScanSettings`] say how; [`ScanPlan`] is the two
//! together: every line's origin, its beams, and the area each beam stands for. [`ScanPlan::lines`] casts them, all cores at work,
//! and [`ScanPlan::areas`] adds them up. Ranges are exact: no millimetres, no device; what a real scanner would make of a scan is
//! [`crate::optics`]'s business.

mod areas;
mod kind;
mod plan;
mod target;
mod wood;

pub use areas::ScanAreas;
pub use kind::{Sampling, ScanKind};
pub use plan::{Line, ScanError, ScanPlan, ScanSettings};
pub use target::{Extent, Target};
pub use wood::{Casts, Mesh, MeshError, WoodTest};

/// Leaves of a beam that I_3L counts (the paper's "three outer layers").
pub const LAYERS: usize = 3;

/// |beam · leaf normal| below which a leaf's visible area is counted as if it were this: a leaf seen edge-on would count without bound.
pub const LEAST_INCIDENCE: f64 = 0.02;
