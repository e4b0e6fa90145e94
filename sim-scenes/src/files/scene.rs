//! Scenes by built-in name or file.

use std::path::Path;

use rowscan_protocol::rig::{OldRoof, Rig};

use super::error::LoadError;
use super::source_text::SourceText;
use super::warning::Warning;
use crate::builtin;
use crate::parameters::SceneFile;
use crate::scene::{FromFile, Scene};

/// A scene by built-in name or file, validated, with the files it names. `tell` hears what the user should know of it.
///
/// # Errors
/// No such scene, a file that cannot be read, or content that is refused.
pub fn load_scene(name: &str, mut tell: impl FnMut(Warning)) -> Result<Scene, LoadError> {
    let source = SourceText::find("scene", name, builtin::text, builtin::names().collect())?;
    let FromFile { mut scene, old_roofs } = source.parse()?;
    for file in scene.files_mut() {
        fill(file, source.folder())?;
    }
    calibration_beside(&mut scene.rig, source.folder());
    scene.validate().map_err(|cause| LoadError::Scene { place: source.place.clone(), cause })?;
    old_roofs.into_iter().for_each(|about| tell(Warning::OldRoof { place: source.place.clone(), about }));
    if scene.optics.air_is_off() {
        tell(Warning::AirIsOff { place: source.place.clone() });
    }
    if let Some(keys) = scene.orchard.without_effect() {
        tell(Warning::NoEffect { place: source.place.clone(), keys });
    }
    let cast = scene.optics.beam_width();
    if let Some(rig) = scene.rig.optics.filter(|rig| *rig != cast) {
        tell(Warning::OtherOptics { place: source.place, rig, cast });
    }
    Ok(scene)
}

/// A calibration that a rig names by a path is looked for in the rig's own folder first, as other files are; one that is not there is left to whoever reads it.
pub(super) fn calibration_beside(rig: &mut Rig, folder: &Path) {
    let is_path = |name: &&String| name.ends_with(".toml");
    let beside = rig.calibration.as_ref().filter(is_path).map(|name| folder.join(name));
    // Recordings keep the rig, and are read in other folders.
    let beside = beside.and_then(|path| std::path::absolute(path).ok());
    if let Some(path) = beside.filter(|path| path.is_file()) {
        rig.calibration = Some(path.to_string_lossy().into_owned());
    }
}

/// A mesh of millions of triangles, as text.
const MOST_BYTES_OF_A_MESH: u64 = 512 * 1024 * 1024;

/// Reads a file that a scene in this folder names.
///
/// # Errors
/// The file cannot be read.
pub fn fill(file: &mut SceneFile, folder: &Path) -> Result<(), LoadError> {
    let path = folder.join(file.path());
    file.fill(
        rowscan_files::read(&path, MOST_BYTES_OF_A_MESH).map_err(|cause| LoadError::Read { path, cause })?,
    );
    Ok(())
}

/// A scene from the text of a file, validated. `tell` hears what the user should know of it.
///
/// # Errors
/// The message, without a place.
pub fn scene_from_text(text: &str, tell: impl FnMut(OldRoof)) -> Result<Scene, String> {
    let FromFile { scene, old_roofs } = rowscan_settings::from_toml(text).map_err(|error| error.message)?;
    scene.validate().map_err(|cause| cause.to_string())?;
    old_roofs.into_iter().for_each(tell);
    Ok(scene)
}
