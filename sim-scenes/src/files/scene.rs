//! Scenes and rigs by built-in name or file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use rowscan_protocol::rig::Rig;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use serde::de::IgnoredAny;

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

/// A rig from the text that recordings have of it: its keys without a table around them.
///
/// # Errors
/// The message, without a place.
pub fn rig_from_text(text: &str) -> Result<Rig, String> {
    rowscan_strict_toml::from_toml(text).map_err(|error| error.message)
}

/// A file that may hold a rig alone.
#[derive(Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
struct RigFile {
    /// A tractor with its scanners: what the estimator believes of them.
    #[serde(default)]
    #[schemars(with = "Rig")]
    rig: Option<Rig>,
    #[serde(flatten)]
    #[schemars(skip)]
    others: BTreeMap<String, IgnoredAny>,
}

/// Keys of a scene that a file with a rig alone may have as well.
const BESIDE_RIG: &[&str] = &["version", "name"];

/// A file with a rig alone, strictly: its errors name the keys of a rig file and not those of a scene.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "read for its errors")]
struct RigAlone {
    version: Option<IgnoredAny>,
    name: Option<IgnoredAny>,
    rig: Option<IgnoredAny>,
}

/// The tables of a file that holds a rig alone.
pub fn rig_schema(generator: &mut SchemaGenerator) -> Schema {
    generator.subschema_for::<RigFile>()
}

/// The keys of a scene file.
fn scene_keys() -> BTreeSet<String> {
    let schema = SchemaGenerator::default().into_root_schema_for::<Scene>();
    let keys = schema.get("properties").and_then(serde_json::Value::as_object);
    keys.into_iter().flat_map(|keys| keys.keys().cloned()).collect()
}

/// A rig from a rig file, a scene file or a built-in scene's name; the scene with it, unless the file holds a rig alone: a file with any other
/// table is a scene, whose orchard, optics and drive count, even where they are left out.
///
/// # Errors
/// As [`load_scene`].
pub fn load_rig(name: &str) -> Result<(Rig, Option<Scene>), LoadError> {
    let source = SourceText::find("rig or scene", name, builtin::text, builtin::names().collect())?;
    let file: RigFile = source.parse()?;
    let mut strange = file.others.keys().filter(|key| !BESIDE_RIG.contains(&key.as_str())).peekable();
    let is_alone = strange.peek().is_none();
    if !is_alone {
        // What is no rig alone is a scene, or has a key that neither has.
        let scene_keys = scene_keys();
        if !strange.any(|key| scene_keys.contains(key)) {
            source.parse::<RigAlone>()?;
        }
    }
    let rig = match file.rig {
        Some(rig) if is_alone => rig,
        _ => return load_scene(name).map(|scene| (scene.resolved_rig(), Some(scene))),
    };
    rig.validate().map_err(|cause| LoadError::Rig { place: source.place, cause })?;
    Ok((rig, None))
}
