//! The orchard: rows of trees that repeat forever along Y.

mod by_row;
mod grow;
pub(crate) mod grown;
mod habit;
pub(crate) mod layout;
pub mod parameters;
mod preset;
mod spelled_out;

pub use by_row::ByRow;
pub use grown::Orchard;
pub use habit::WithoutEffect;
pub use layout::{Layout, LayoutOverrides};
pub use parameters::OrchardParameters;
pub use preset::Preset;
