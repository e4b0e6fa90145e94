//! Rigs: in files of their own, in scenes, in recordings.

use std::collections::{BTreeMap, BTreeSet};

use rowscan_protocol::rig::{OLDEST_VERSION, OldRoof, Rig, RigError, VERSION};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

use super::error::LoadError;
use super::scene::{calibration_beside, load_scene};
use super::source_text::SourceText;
use super::warning::Warning;
use crate::builtin;
use crate::scene::Scene;

/// A file that may hold a rig alone.
#[derive(Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
struct RigFile {
    /// Format of the file. In version 1, `roof` of a scanner means something else: docs/rigs.md.
    #[serde(default = "oldest")]
    #[schemars(range(min = OLDEST_VERSION, max = VERSION), example = VERSION)]
    version: u32,
    /// What to call it.
    #[schemars(with = "Option<String>", example = &"mast")]
    #[expect(dead_code, reason = "it is for those who read the file")]
    name: Option<IgnoredAny>,
    /// A tractor with its scanners: what the estimator believes of them.
    #[serde(default)]
    #[schemars(with = "Rig")]
    rig: Option<Rig>,
    #[serde(flatten)]
    #[schemars(skip)]
    others: BTreeMap<String, IgnoredAny>,
}

fn oldest() -> u32 {
    OLDEST_VERSION
}

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
/// table is a scene, whose orchard, optics and drive count, even where they are left out. `tell` hears what the user should know of it.
///
/// # Errors
/// As [`load_scene`].
pub fn load_rig(name: &str, mut tell: impl FnMut(Warning)) -> Result<(Rig, Option<Scene>), LoadError> {
    let source = SourceText::find("rig or scene", name, builtin::text, builtin::names().collect())?;
    let file: RigFile = source.parse()?;
    let is_alone = file.others.is_empty();
    if !is_alone {
        // What is no rig alone is a scene, or has a key that neither has.
        let scene_keys = scene_keys();
        if !file.others.keys().any(|key| scene_keys.contains(key)) {
            source.parse::<RigAlone>()?;
        }
    }
    let folder = source.folder().to_owned();
    let place = source.place;
    match file.rig {
        Some(rig) if is_alone => {
            let tell = |about| tell(Warning::OldRoof { place: place.clone(), about });
            let rig = sound(file.version, rig, tell);
            let mut rig = rig.map_err(|cause| LoadError::Rig { place: place.clone(), cause })?;
            calibration_beside(&mut rig, &folder);
            Ok((rig, None))
        }
        _ => load_scene(name, tell).map(|scene| (scene.resolved_rig(), Some(scene))),
    }
}

/// The rig of a document of this version.
fn sound(version: u32, mut rig: Rig, tell: impl FnMut(OldRoof)) -> Result<Rig, RigError> {
    let old_roofs = rig.migrate(version)?;
    rig.validate()?;
    old_roofs.into_iter().for_each(tell);
    Ok(rig)
}

/// A rig as the text of a rig file: what recordings hold.
///
/// # Errors
/// A rig with a value that TOML does not have.
pub fn rig_text(rig: &Rig) -> Result<String, toml::ser::Error> {
    #[derive(Serialize)]
    struct Written<'a> {
        version: u32,
        rig: &'a Rig,
    }
    toml::to_string(&Written { version: VERSION, rig })
}

/// A rig from the text that a recording holds: a rig file's, or the table `[rig]` by itself, as recordings of version 1 have it. `tell` hears what
/// the user should know of it.
///
/// # Errors
/// The message, without a place.
pub fn rig_from_text(text: &str, tell: impl FnMut(OldRoof)) -> Result<Rig, String> {
    let file: RigFile = rowscan_settings::from_toml(text).map_err(|error| error.message)?;
    let rig = match file.rig {
        Some(rig) => rig,
        None => rowscan_settings::from_toml(text).map_err(|error| error.message)?,
    };
    sound(file.version, rig, tell).map_err(|cause| cause.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::rig::{Mount, Roof, RowSide};

    #[test]
    fn the_text_of_a_rig_is_read_as_it_was_meant() {
        for roof in [None, Some(Roof::Forward), Some(Roof::Backward)] {
            let left = Mount { row: RowSide::Left, roof, ..Mount::default() };
            let rig = Rig { scanners: vec![Mount { roof, ..Mount::default() }, left], ..Rig::default() };
            let text = rig_text(&rig).unwrap();
            assert!(text.starts_with("version = 2\n") && text.contains("\n[rig]\n"), "{text}");
            assert_eq!(rig_from_text(&text, |old| panic!("{old}")), Ok(rig));
        }
    }

    #[test]
    fn the_table_that_recordings_of_version_1_hold_keeps_its_meaning() {
        // As written for the default rig, with every key of a mount.
        let text = "speed_m_s = 1.0\nstart_m = 0.0\nground_clearance_m = 0.1\n\n[[scanner]]\nmodel = \"lms111\"\n\
                    orientation = \"side\"\nroof = \"forward\"\nrow = \"right\"\nheight_m = 1.6\ndistance_m = 1.9\n";
        let mut told = Vec::new();
        let rig = rig_from_text(text, |old| told.push(old)).unwrap();
        assert_eq!(rig.scanners[0].angle_map(), (1.0, -90.0));
        assert_eq!(told, [OldRoof { scanner: 0, written: Roof::Forward, means: Roof::Backward }]);
        let backward = text.replace("forward", "backward");
        assert_eq!(rig_from_text(&backward, |_| {}).unwrap().scanners[0].angle_map(), (-1.0, 90.0));
        for wrong in [format!("version = 3\n[rig]\n{text}"), text.replace("speed_m_s", "speed")] {
            assert!(rig_from_text(&wrong, |_| {}).is_err(), "{wrong}");
        }
    }
}
