//! Figures of the studies, as SVG: one file a figure; what they have in common stands in `style.rs`, `chart.rs` and `canvas.rs`.

mod areas;
mod axis;
mod canvas;
mod chart;
pub mod colours;
mod course;
mod metres;
mod physics;
mod resolution;
mod scanned;
mod sheet;
mod style;
mod sweep;
mod symbols;
mod words;

pub use areas::areas;
pub use course::{Course, course};
pub use metres::{Metre, Metres, metres};
pub use physics::physics;
pub use resolution::resolution;
pub use scanned::{Legend, Panel, scanned};
pub use sheet::{Sheet, Window};
pub use sweep::sweep;
