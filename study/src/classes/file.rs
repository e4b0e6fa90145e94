//! The file of classes.

use std::collections::BTreeMap;
use std::path::Path;

use rowscan_scenes::Scene;
use rowscan_scenes::files::Warning;
use serde::Deserialize;
use toml::Table;

use super::{Class, Classes, Reimport};
use crate::complaint::Complaint;
use crate::document::Document;
use crate::settings;
use crate::{Setting, StudyFileError};

/// Format of the file.
const VERSION: u32 = 1;
/// The classes that ship with the program.
const BUILT_IN: &str = include_str!("../../classes.toml");

#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct ClassesFile {
    /// Format of the file.
    #[schemars(range(min = 1, max = 1), example = 1)]
    version: u32,
    /// What to call them.
    #[serde(default)]
    name: String,
    /// The scene that classes depart from: a built-in one's name, or a file beside this one.
    #[schemars(example = &"spindle")]
    scene: String,
    /// The properties in which classes differ.
    axis: Vec<AxisFile>,
}

#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct AxisFile {
    /// Its name; that of a class key (leaf_angle, leaf_size, season, generator, training_system, wood_share, optics, distance, height, line_spacing, crown_depth) gives the between-class
    /// term of intervals.
    #[schemars(example = &"leaf_angle")]
    name: String,
    /// Its classes, two or more.
    class: Vec<ClassFile>,
}

#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct ClassFile {
    /// Its name.
    #[schemars(example = &"45 ± 18°")]
    name: String,
    /// What it departs from, instead of the file's scene.
    #[serde(default)]
    #[schemars(example = &"mature")]
    scene: Option<String>,
    /// What it sets: keys of a scene, in quotes, with their values.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>", example = set_example())]
    set: Table,
    /// What the estimator believes and is not so: keys of the rig.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>", example = told_example())]
    told: Table,
    /// What becomes of the grown trees.
    #[serde(default)]
    reimport: Option<Reimport>,
}

fn set_example() -> BTreeMap<String, f64> {
    BTreeMap::from([("orchard.tree.leaf_angle_mean_deg".to_owned(), 45.0)])
}

fn told_example() -> BTreeMap<String, f64> {
    BTreeMap::from([("rig.scanner.distance_m".to_owned(), 2.0)])
}

/// The tables of a file of classes.
pub fn schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
    generator.subschema_for::<ClassesFile>()
}

/// Reads a file of classes. Scenes that are files are looked for beside it; `tell` hears what the user should know of them.
///
/// # Errors
/// A file that cannot be read, names no classes, or keys or values that a scene does not have.
pub fn read(path: &Path, tell: impl FnMut(Warning)) -> Result<Classes, StudyFileError> {
    of_document(&Document::open(path)?, tell)
}

/// The classes that ship with the program.
///
/// # Errors
/// None, which a test holds.
pub fn built_in() -> Result<Classes, StudyFileError> {
    of_document(&Document::built_in("classes.toml", BUILT_IN), |_| {})
}

fn of_document(document: &Document<'_>, mut tell: impl FnMut(Warning)) -> Result<Classes, StudyFileError> {
    let file: ClassesFile = document.parse()?;
    if file.version != VERSION {
        let message = format!("version must be {VERSION}, found {}", file.version);
        return Err(document.refuse(Complaint::new("version", message)));
    }
    let (base, mut shelf) = document.scene(&file.scene, &mut tell)?;
    shelf.stock(&mut base.clone())?;
    let mut classes = Vec::new();
    for axis in file.axis {
        if axis.class.len() < 2 {
            let message =
                format!("axis `{}`: expected two classes or more, found {}", axis.name, axis.class.len());
            return Err(document.refuse(Complaint::new(axis.name, message)));
        }
        for class in axis.class {
            let own = class.scene.as_deref().map(|name| document.scene(name, &mut tell)).transpose()?;
            let from = own.map_or_else(|| base.clone(), |(scene, _)| scene);
            let mut class = class
                .checked(&axis.name, Scene { seed: base.seed, ..from })
                .map_err(|complaint| document.refuse(complaint))?;
            shelf.stock(&mut class.scene)?;
            classes.push(class);
        }
    }
    Ok(Classes { name: file.name, scene: base, classes, files: shelf })
}

impl ClassFile {
    fn checked(self, axis: &str, base: Scene) -> Result<Class, Complaint> {
        let refuse = |name: &str, why: String| Complaint::new(name, format!("class `{name}`: {why}"));
        let with = |scene: &Scene, keys: &Table| {
            settings::of_first_scanner(keys.keys().map(String::as_str))?;
            let settings: Vec<Setting<'_>> =
                keys.iter().map(|(key, value)| (key.as_str(), value.clone())).collect();
            settings::set_in_scene(scene, &settings)
        };
        let scene = with(&base, &self.set).map_err(|why| refuse(&self.name, why))?;
        let told = with(&scene, &self.told).map_err(|why| refuse(&self.name, why))?;
        if let Some(stray) = self.told.keys().find(|key| !key.starts_with("rig.")) {
            let why = format!("the estimator is told of the rig only, `told` holds `{stray}`");
            return Err(refuse(&self.name, why));
        }
        if let Some(why) = self.reimport.and_then(|reimport| reimport.refusal()) {
            return Err(refuse(&self.name, why));
        }
        Ok(Class {
            axis: axis.to_owned(),
            name: self.name,
            told: (!self.told.is_empty()).then(|| told.resolved_rig()),
            scene,
            reimport: self.reimport,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_canopy::ClassKey;

    #[test]
    fn the_built_in_classes_are_sound_and_hold_every_class_key() {
        let classes = built_in().expect("sound");
        let axes = classes.axes();
        assert!(ClassKey::ALL.into_iter().all(|key| axes.contains(&key.name())), "{axes:?}");
        for class in &classes.classes {
            let same = |other: &&Class| other.axis == class.axis && other.name == class.name;
            assert_eq!(classes.classes.iter().filter(same).count(), 1, "{} {}", class.axis, class.name);
        }
        assert_eq!(classes.clone().of_axes(&["season".to_owned()]).axes(), ["season"]);
    }

    fn refusal(class: &str) -> String {
        let text = format!(
            "version = 1\nscene = \"spindle\"\n[[axis]]\nname = \"a\"\n[[axis.class]]\nname = \"one\"\n[[axis.class]]\nname = \"two\"\n{class}\n"
        );
        of_document(&Document::built_in("c.toml", &text), |_| {}).expect_err(class).to_string()
    }

    #[test]
    fn a_class_that_cannot_be_is_refused_with_its_line() {
        let wrong = refusal("set = { \"orchard.tree.iteration\" = 3 }");
        assert!(wrong.starts_with("c.toml:8:") && wrong.contains("did you mean `iterations`"), "{wrong}");
        let told = refusal("told = { \"orchard.tree.iterations\" = 3 }");
        assert!(told.contains("told of the rig only"), "{told}");
        let shrunk = refusal("reimport = { leaf_scale = 0.0, tilt_deg = 0.0 }");
        assert!(shrunk.contains("leaf_scale: expected above 0, up to 10, found 0"), "{shrunk}");
        let turned = refusal("reimport = { leaf_scale = 1.0, tilt_deg = 200.0 }");
        assert!(turned.contains("tilt_deg: expected from 0 to 90, found 200"), "{turned}");
        let lone =
            "version = 1\nscene = \"spindle\"\n[[axis]]\nname = \"a\"\n[[axis.class]]\nname = \"one\"\n";
        let why = of_document(&Document::built_in("c.toml", lone), |_| {}).expect_err("one").to_string();
        assert!(why.contains("two classes or more, found 1"), "{why}");
    }
}
