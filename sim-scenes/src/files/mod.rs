//! Scene and rig files: strict TOML, by path or by the name of a built-in scene.
//!
//! This is the only part of the crate that reads files. It needs the feature `files`.
//!
//! ```
//! use rowscan_scenes::files::load_scene;
//! let scene = load_scene("spindle", |warning| eprintln!("{warning}"))?;
//! assert_eq!(scene.name, "spindle");
//! let error = load_scene("spindel", |_| {}).unwrap_err();
//! assert!(error.to_string().ends_with("did you mean `spindle`?"));
//! # Ok::<(), rowscan_scenes::files::LoadError>(())
//! ```

mod error;
mod rig;
mod scene;
mod source_text;
mod warning;

pub use error::{LoadError, nearest};
pub use rig::{load_rig, rig_from_text, rig_schema, rig_text};
pub use rowscan_settings::{TomlError, from_toml};
pub use scene::{fill, load_scene, scene_from_text};
pub use source_text::SourceText;
pub use warning::Warning;
