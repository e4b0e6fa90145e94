//! Figures of the studies, as SVG: one file a figure; what they have in common stands in `style.rs`.

mod areas;
pub mod colours;
mod metres;
mod physics;
mod resolution;
mod scanned;
mod sheet;
mod style;
mod sweep;

use plotters::prelude::DrawingAreaErrorKind;

pub use areas::areas;
pub use metres::{Metre, Metres, metres};
pub use physics::physics;
pub use resolution::resolution;
pub use scanned::{Legend, Panel, scanned};
pub use sheet::{Sheet, Window};
pub use sweep::sweep;

/// Why a figure could not be drawn.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the figure cannot be drawn: {0}")]
pub struct DrawError(String);

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for DrawError {
    fn from(cause: DrawingAreaErrorKind<E>) -> Self {
        Self(cause.to_string())
    }
}
