//! Scenes, rigs and calibrations by name or by file.

use std::path::{Path, PathBuf};

use rowscan_canopy::Calibration;
use rowscan_protocol::rig::{Rig, RigError};
use rowscan_scenes::parameters::SceneFile;
use rowscan_scenes::{Scene, SceneError, builtin};
use serde::Deserialize;

use super::strict;

/// Why a scene, a rig or a calibration could not be used. Each message names the place and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// Neither a built-in name nor a file.
    #[error("there is no {what} `{name}`: it is neither a file nor built in; built in are {}{}", .built_in.join(", "), nearest(.name, .built_in))]
    Missing {
        /// Scene, rig or calibration.
        what: &'static str,
        /// What was asked for.
        name: String,
        /// The names that would do.
        built_in: Vec<&'static str>,
    },
    /// The file could not be read.
    #[error("cannot read {}: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// The file is not what it should be.
    #[error("{place}:{}: {}", trouble.line, trouble.message)]
    Content {
        /// File or built-in name.
        place: String,
        /// What is wrong.
        trouble: strict::Trouble,
    },
    /// A scene whose values make no orchard.
    #[error("{place}: {cause}")]
    Scene {
        /// File or built-in name.
        place: String,
        /// What is wrong.
        cause: SceneError,
    },
    /// A rig whose values make no measurement.
    #[error("{place}: {cause}")]
    Rig {
        /// File or built-in name.
        place: String,
        /// What is wrong.
        cause: RigError,
    },
    /// A calibration that cannot be trusted.
    #[error("{place}: {cause}")]
    Calibration {
        /// File or built-in name.
        place: String,
        /// What is wrong.
        cause: rowscan_canopy::CalibrationError,
    },
}

/// `; did you mean X?` where one of the names is much like this one, else nothing.
pub fn nearest(name: &str, names: &[&str]) -> String {
    names
        .iter()
        .map(|known| (strsim::jaro_winkler(name, known), known))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, known)| format!("; did you mean `{known}`?"))
        .unwrap_or_default()
}

/// A text with the place it came from.
struct Text {
    place: String,
    text: String,
}

impl Text {
    /// The file `name`, or else the built-in of that name.
    fn find(
        what: &'static str,
        name: &str,
        built_in: impl Fn(&str) -> Option<&'static str>,
        names: Vec<&'static str>,
    ) -> Result<Self, ConfigError> {
        let path = Path::new(name);
        if let Some(text) = built_in(name).filter(|_| !path.is_file()) {
            return Ok(Self { place: format!("built-in {what} {name}"), text: text.to_owned() });
        }
        match std::fs::read_to_string(path) {
            Ok(text) => Ok(Self { place: name.to_owned(), text }),
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => {
                Err(ConfigError::Missing { what, name: name.to_owned(), built_in: names })
            }
            Err(cause) => Err(ConfigError::Read { path: path.to_owned(), cause }),
        }
    }

    /// The folder from which the relative paths in this text count.
    fn folder(&self) -> &Path {
        Path::new(&self.place).parent().unwrap_or(Path::new(""))
    }

    fn read<T: serde::de::DeserializeOwned>(&self) -> Result<T, ConfigError> {
        strict::from_toml(&self.text)
            .map_err(|trouble| ConfigError::Content { place: self.place.clone(), trouble })
    }
}

/// A scene by built-in name or file, validated.
pub fn load_scene(name: &str) -> Result<Scene, ConfigError> {
    let text = Text::find("scene", name, builtin::text, builtin::names().collect())?;
    let mut scene: Scene = text.read()?;
    for file in scene.files_mut() {
        fill(file, text.folder())?;
    }
    scene.validate().map_err(|cause| ConfigError::Scene { place: text.place.clone(), cause })?;
    scene.resolved_rig().validate().map_err(|cause| ConfigError::Rig { place: text.place, cause })?;
    Ok(scene)
}

/// Reads a file that a scene of this folder names.
pub fn fill(file: &mut SceneFile, folder: &Path) -> Result<(), ConfigError> {
    let path = folder.join(file.path());
    file.fill(std::fs::read(&path).map_err(|cause| ConfigError::Read { path, cause })?);
    Ok(())
}

/// A scene from the text of a file, validated; what is wrong, without a place.
pub fn scene_from_text(text: &str) -> Result<Scene, String> {
    let scene: Scene = strict::from_toml(text).map_err(|trouble| trouble.message)?;
    scene.validate().map_err(|cause| cause.to_string())?;
    scene.resolved_rig().validate().map_err(|cause| cause.to_string())?;
    Ok(scene)
}

/// A file that may hold nothing but a rig.
#[derive(Deserialize)]
struct RigFile {
    #[serde(default)]
    rig: Option<Rig>,
    #[serde(default)]
    orchard: Option<serde::de::IgnoredAny>,
}

/// A rig from a rig file, a scene file or a built-in scene's name; the scene with it, unless the file holds a rig alone.
pub fn load_rig(name: &str) -> Result<(Rig, Option<Scene>), ConfigError> {
    let text = Text::find("rig or scene", name, builtin::text, builtin::names().collect())?;
    let file: RigFile = text.read()?;
    let rig = match file {
        RigFile { rig: Some(rig), orchard: None } => rig,
        _ => return load_scene(name).map(|scene| (scene.resolved_rig(), Some(scene))),
    };
    rig.validate().map_err(|cause| ConfigError::Rig { place: text.place, cause })?;
    Ok((rig, None))
}

/// The calibration a rig names, for the scanner model it carries: `NAME-MODEL` where calibrations of that name are shipped, none if
/// they are shipped for other models only; else whatever `NAME` is.
pub fn load_calibration_for(name: &str, model: &str) -> Result<Option<Calibration>, ConfigError> {
    let specific = format!("{name}-{model}");
    let family = format!("{name}-");
    if rowscan_canopy::shipped::text(&specific).is_some() {
        load_calibration(&specific).map(Some)
    } else if rowscan_canopy::shipped::names().any(|shipped| shipped.starts_with(&family)) {
        Ok(None)
    } else {
        load_calibration(name).map(Some)
    }
}

/// A calibration by shipped name or file, validated.
pub fn load_calibration(name: &str) -> Result<Calibration, ConfigError> {
    let text = Text::find(
        "calibration",
        name,
        rowscan_canopy::shipped::text,
        rowscan_canopy::shipped::names().collect(),
    )?;
    let calibration: Calibration = text.read()?;
    calibration.validate().map_err(|cause| ConfigError::Calibration { place: text.place, cause })?;
    Ok(calibration)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_family_has_calibrations_for_some_models_and_a_wrong_name_has_none() {
        assert!(load_calibration_for("spindle", "lms111").is_ok_and(|found| found.is_some()));
        assert!(load_calibration_for("spindle", "no-such-model").is_ok_and(|found| found.is_none()));
        assert!(matches!(load_calibration_for("spindel", "lms111"), Err(ConfigError::Missing { .. })));
    }
}
