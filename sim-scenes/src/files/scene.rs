//! Scenes and rigs by built-in name or file.

use std::path::Path;

use rowscan_protocol::rig::Rig;
use serde::Deserialize;

use super::error::LoadError;
use super::source_text::SourceText;
use crate::builtin;
use crate::parameters::SceneFile;
use crate::scene::Scene;

/// A scene by built-in name or file, validated, with the files it names.
///
/// # Errors
/// No such scene, a file that cannot be read, or content that is refused.
pub fn load_scene(name: &str) -> Result<Scene, LoadError> {
    let source = SourceText::find("scene", name, builtin::text, builtin::names().collect())?;
    let mut scene: Scene = source.parse()?;
    for file in scene.files_mut() {
        fill(file, source.folder())?;
    }
    scene.validate().map_err(|cause| LoadError::Scene { place: source.place, cause })?;
    Ok(scene)
}

/// Reads a file that a scene in this folder names.
///
/// # Errors
/// The file cannot be read.
pub fn fill(file: &mut SceneFile, folder: &Path) -> Result<(), LoadError> {
    let path = folder.join(file.path());
    file.fill(std::fs::read(&path).map_err(|cause| LoadError::Read { path, cause })?);
    Ok(())
}

/// A scene from the text of a file, validated.
///
/// # Errors
/// The message, without a place.
pub fn scene_from_text(text: &str) -> Result<Scene, String> {
    let scene: Scene = rowscan_strict_toml::from_toml(text).map_err(|error| error.message)?;
    scene.validate().map_err(|cause| cause.to_string())?;
    Ok(scene)
}

/// A file that may hold a rig alone.
#[derive(Deserialize)]
struct RigFile {
    #[serde(default)]
    rig: Option<Rig>,
    #[serde(default)]
    orchard: Option<serde::de::IgnoredAny>,
}

/// A rig from a rig file, a scene file or a built-in scene's name; the scene with it, unless the file holds a rig alone.
///
/// # Errors
/// As [`load_scene`].
pub fn load_rig(name: &str) -> Result<(Rig, Option<Scene>), LoadError> {
    let source = SourceText::find("rig or scene", name, builtin::text, builtin::names().collect())?;
    let file: RigFile = source.parse()?;
    let rig = match file {
        RigFile { rig: Some(rig), orchard: None } => rig,
        _ => return load_scene(name).map(|scene| (scene.resolved_rig(), Some(scene))),
    };
    rig.validate().map_err(|cause| LoadError::Rig { place: source.place, cause })?;
    Ok((rig, None))
}
