//! Scene and rig files: strict TOML, by path or by the name of a built-in scene.
//!
//! This is the only part of the crate that reads files. It needs the feature `files`.
//!
//! ```
//! let scene = rowscan_scenes::files::load_scene("spindle")?;
//! assert_eq!(scene.name, "spindle");
//! let error = rowscan_scenes::files::load_scene("spindel").unwrap_err();
//! assert!(error.to_string().ends_with("did you mean `spindle`?"));
//! # Ok::<(), rowscan_scenes::files::LoadError>(())
//! ```

mod error;
mod scene;
mod source_text;

pub use error::{LoadError, nearest};
pub use rowscan_strict_toml::{TomlError, from_toml};
pub use scene::{fill, load_rig, load_scene, rig_from_text, rig_schema, scene_from_text};
pub use source_text::SourceText;
