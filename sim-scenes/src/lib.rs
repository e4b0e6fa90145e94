//! Virtual orchards: how trees grow, where every leaf and branch is, what a laser scanner sees of them, and the exact
//! leaf area the scan should be turned back into.
//!
//! The way through the crate: a [`Scene`] (a TOML file, or one of the [`builtin`] ones) names an orchard and a rig;
//! [`Orchard::grow`] grows it; [`Orchard::truth`] says what is there; [`Caster::cast`] says what the beams of one
//! mirror turn meet; [`optics::measure`] says what the scanner makes of that.
//!
//! Scene frame: X across the row from the scanner into the vegetation, Y along the row (travel), Z up; metres. The axis
//! of the first row is X = 0, the ground is Z = 0. θ is measured from +X, positive up.
//!
//! ```
//! use rowscan_scenes::orchard::{OrchardParameters, Preset};
//! use rowscan_scenes::{BeamFan, Caster, Orchard, Return, Scratch};
//!
//! let parameters = OrchardParameters { trees: Some(1), ..OrchardParameters::of(Preset::Paper) };
//! let orchard = Orchard::grow(&parameters, 1, &|_, _| {})?;
//! let truth = orchard.truth();
//! assert!(truth.leaf_area_m2 > 0.0);
//!
//! let pose = rowscan_protocol::scan::Pose { x_m: -1.9, y_m: 1.5, z_m: 1.6 };
//! let fan = BeamFan::from_degrees(-45.0, 0.5, 181);
//! let mut returns = vec![Return::MISS; 181];
//! Caster::new(&orchard).cast(pose, &fan, &mut Scratch::default(), &mut returns);
//! assert!(returns.iter().any(|met| met.range_m.is_finite()));
//! # Ok::<(), rowscan_scenes::GrowError>(())
//! ```
//!
//! A built-in scene by name needs the feature `files`: `files::load_scene("spindle", |_| {})`. [`rowscan-emulator`](https://docs.rs/rowscan-emulator) puts a
//! scanner beside it that any client can read, [`rowscan-canopy`](https://docs.rs/rowscan-canopy) estimates what [`Truth`] knows.
//!
//! Without the feature `files` the crate does no I/O. It reads no clock and keeps no global state. The same scene and seed give
//! the same bytes on any machine and any number of threads: random streams are keyed ([`seed`]), elementary functions come from `libm`.

pub mod analytic;
mod angle;
mod bins;
pub mod builtin;
pub mod caster;
mod cells;
pub mod drawing;
pub mod exchange;
#[cfg(feature = "files")]
pub mod files;
mod form;
pub mod generator;
mod ground;
pub mod growth;
pub mod import;
mod lanes;
pub mod lsystem;
pub mod optics;
pub mod orchard;
pub mod organ;
pub mod parameters;
pub mod patches;
mod placement;
pub mod polygon;
pub mod scan;
pub mod scene;
pub mod season;
pub mod seed;
mod seen;
mod seen_row;
mod sower;
mod support;
mod target;
pub mod trained;
pub mod triangles;
mod true_mount;
mod truth;
mod wind;

pub use caster::{BeamFan, Beams, Caster, Class, Cone, Layers, ParallelBeams, Registers, Return, Scratch};
pub use cells::{Cell, CellAreas, CellColumn, CellGrid, ColumnBand, RowCells};
pub use form::CanopyForm;
pub use generator::{FoliageShares, GeneratorKind, GrowError, Remark};
pub use ground::{Ground, GroundOverrides, GroundParameters};
pub use orchard::{Orchard, OrchardParameters};
pub use organ::{Cylinder, Facet, Leaf, OrganError, Surface, Tree};
pub use placement::Placement;
pub use scene::{Scene, SceneError};
pub use seen::{SeenCell, Track};
pub use seen_row::SeenRow;
pub use support::{Support, SupportKind, Trellis};
pub use target::{Adjustment, TargetError};
pub use true_mount::TrueMount;
pub use truth::{HeightBand, RowSlab, TreeTruth, Truth, TruthGrid};
pub use wind::{Lean, Wind};
