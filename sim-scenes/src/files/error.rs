//! Why a scene or rig file cannot be used.

use std::path::PathBuf;

use rowscan_protocol::rig::RigError;
use rowscan_settings::TomlError;

use crate::scene::SceneError;

/// Why a scene or a rig could not be loaded. Each message names the file and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// Neither a built-in name nor a file.
    #[error("there is no {what} `{name}`: it is neither a file nor built in; built in are {}{}", .built_in.join(", "), nearest(.name, .built_in))]
    Missing {
        /// Scene, rig or calibration.
        what: &'static str,
        /// The name or path that was given.
        name: String,
        /// The built-in names.
        built_in: Vec<&'static str>,
    },
    /// The file could not be read.
    #[error("cannot read {}: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        #[source]
        cause: std::io::Error,
    },
    /// The file is not valid TOML of this kind.
    #[error("{place}:{}: {}", error.line, error.message)]
    Content {
        /// File or built-in name.
        place: String,
        /// The error and its line.
        error: TomlError,
    },
    /// A scene with a value out of range.
    #[error("{place}: {cause}")]
    Scene {
        /// File or built-in name.
        place: String,
        /// The value.
        cause: SceneError,
    },
    /// A rig with a value out of range.
    #[error("{place}: {cause}")]
    Rig {
        /// File or built-in name.
        place: String,
        /// The value.
        cause: RigError,
    },
}

/// `; did you mean X?` where one of the names resembles this one, else nothing.
pub fn nearest(name: &str, names: &[&str]) -> String {
    names
        .iter()
        .map(|known| (strsim::jaro_winkler(name, known), known))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, known)| format!("; did you mean `{known}`?"))
        .unwrap_or_default()
}
