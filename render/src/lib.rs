//! Pictures of virtual orchards: leaves in their real outlines, wood as tapered tubes, posts, wires, fruit and ground, in sun and skylight.
//!
//! The way through the crate: [`Model`] turns an orchard into triangles; `Lighting` finds how much sky every corner of them sees and
//! where the sun's shadows fall; [`Camera`] says where to look from, [`View`] names the usual places; [`render`] gives a [`Picture`].
//!
//! Scene frame: X across the row, Y along it, Z up; metres. The crate does no I/O, reads no clock and keeps no global state. The same orchard
//! and settings give the same bytes on any number of threads.
//!
//! ```
//! use rowscan_render::{Camera, Look, Model, View, render};
//! use rowscan_scenes::orchard::{Orchard, OrchardParameters, Preset};
//!
//! let parameters = OrchardParameters { trees: Some(1), ..OrchardParameters::of(Preset::Spindle) };
//! let orchard = Orchard::grow(&parameters, 1, &|_, _| {})?;
//! let model = Model::of(&orchard, usize::MAX)?;
//! let camera = View::Side.camera(&model, (80, 60))?;
//! let picture = render(&model, &camera, &Look::default());
//! assert_eq!(picture.rgb().len(), 80 * 60 * 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod camera;
mod depth_map;
mod error;
mod figure;
mod light;
mod mark;
mod mesh;
mod model;
mod noise;
mod paint;
mod palette;
mod picture;
mod raster;
mod renderer;
mod shade;
mod sky;
mod tone;
mod tube;
mod view;
mod visible;

pub use camera::Camera;
pub use error::RenderError;
pub use figure::Figure;
pub use mark::Mark;
pub use model::Model;
pub use picture::Picture;
pub use renderer::{Backdrop, Look, render};
pub use view::View;
