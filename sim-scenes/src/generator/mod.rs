//! The generators: what makes the trees of an orchard.
//!
//! A generator turns a place of the orchard into a draft: branches and leaves with what bears them. What follows is the
//! same for all of them (`plant`): shade, shears, season, target leaf area. A new generator is one file with `impl Generator`, a name
//! in [`GeneratorKind`] and its line in `make`.

pub(crate) mod draft;
pub(crate) mod error;
pub(crate) mod foliage_shares;
pub(crate) mod kind;
mod make;
pub(crate) mod plant;
pub(crate) mod planting;
pub(crate) mod remark;

pub use error::GrowError;
pub use foliage_shares::FoliageShares;
pub use kind::GeneratorKind;
pub use remark::Remark;
