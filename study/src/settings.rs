//! What a study departs from, with keys of it set by name: `rig.scanner.height_m`, `orchard.tree.iterations`, `rig.scanner[1].distance_m`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use rowscan_scenes::Scene;
use rowscan_scenes::files::{self, LoadError};
use rowscan_scenes::parameters::SceneFile;
use serde::Serialize;
use toml::{Table, Value};

use super::complaint::Complaint;

/// A key with its value.
pub type Setting<'a> = (&'a str, Value);

/// `base` with these keys set, as `read` reads it. A key into an array of tables without a number sets all of them.
///
/// The base is written as TOML, changed there, and read again as strictly as a file: what names nothing, or holds what it may
/// not, is refused with the nearest valid key.
pub(super) fn set<T: Serialize>(
    base: &T,
    settings: &[Setting<'_>],
    read: impl FnOnce(&str) -> Result<T, String>,
) -> Result<T, String> {
    let mut table = Table::try_from(base).map_err(|cause| cause.to_string())?;
    for (key, value) in settings {
        let path: Vec<&str> = key.split('.').collect();
        put(&mut table, &path, value).map_err(|why| format!("key `{key}`: {why}"))?;
    }
    let text = toml::to_string(&table).map_err(|cause| cause.to_string())?;
    read(&text).map_err(|why| {
        let keys: Vec<&str> = settings.iter().map(|(key, _)| *key).collect();
        format!("key `{}`: {why}", keys.join("`, `"))
    })
}

/// The same of a scene.
pub(super) fn set_in_scene(scene: &Scene, settings: &[Setting<'_>]) -> Result<Scene, String> {
    // It is written in the present version, of which nothing needs to be told.
    let changed = set(scene, settings, |text| files::scene_from_text(text, |_| {}))?;
    let idle = changed.orchard.without_effect().filter(|idle| {
        let is_set = |key: &&String| settings.iter().any(|(set, _)| set == key);
        idle.keys.iter().any(|key| is_set(&key))
    });
    // A study of such a key would measure an effect of nothing.
    idle.map_or(Ok(changed), |idle| Err(idle.to_string()))
}

/// Why a key of a scene cannot be set.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SettingError(String);

/// A scene with these keys set by name, checked as strictly as a file: `orchard.trees`, `rig.scanner[0].height_m`. Files that it names stay with it.
///
/// # Errors
/// A key that names nothing, with the nearest that does; a value that cannot be.
pub fn scene_with(
    scene: &Scene,
    keys: impl IntoIterator<Item = (String, serde_json::Value)>,
) -> Result<Scene, SettingError> {
    let mut settings = Vec::new();
    for (key, value) in keys {
        let value = Value::try_from(value).map_err(|cause| SettingError(format!("key `{key}`: {cause}")))?;
        settings.push((key, value));
    }
    let settings: Vec<Setting<'_>> =
        settings.iter().map(|(key, value)| (key.as_str(), value.clone())).collect();
    let shelf = Shelf::of_scene(scene);
    let mut changed = set_in_scene(scene, &settings).map_err(SettingError)?;
    shelf.serve(&mut changed).map_err(SettingError)?;
    Ok(changed)
}

/// Refuses keys of scanners that a study does not look through: they would change nothing, and read as without effect.
///
/// # Errors
/// A key of `rig.scanner[n]` with n above 0.
pub(super) fn of_first_scanner<'a>(keys: impl IntoIterator<Item = &'a str>) -> Result<(), String> {
    for key in keys {
        let number = key.strip_prefix("rig.scanner[").and_then(|rest| rest.split_once(']'));
        if number.is_some_and(|(number, _)| number.parse().is_ok_and(|number: usize| number > 0)) {
            return Err(format!(
                "key `{key}`: expected keys of `rig.scanner[0]`, through which this study looks; make that scanner the rig's first"
            ));
        }
    }
    Ok(())
}

fn put(table: &mut Table, path: &[&str], value: &Value) -> Result<(), String> {
    let Some((first, rest)) = path.split_first() else { return Ok(()) };
    let (name, number) = match first.strip_suffix(']').and_then(|text| text.split_once('[')) {
        Some((name, number)) => {
            (name, Some(number.parse::<usize>().map_err(|_| format!("expected a number in `{first}`"))?))
        }
        None => (*first, None),
    };
    if name.is_empty() {
        return Err("expected names joined by dots".to_owned());
    }
    if rest.is_empty() && number.is_none() {
        table.insert(name.to_owned(), value.clone());
        return Ok(());
    }
    // A table that is not there is made: reading the text again says whether it may be.
    let below = table.entry(name).or_insert_with(|| Value::Table(Table::new()));
    match (below, number) {
        (Value::Table(below), None) => put(below, rest, value),
        (Value::Array(items), None) => {
            items.iter_mut().try_for_each(|item| put_item(item, name, rest, value))
        }
        (Value::Array(items), Some(number)) => {
            let count = items.len();
            let item = items.get_mut(number);
            item.map_or_else(
                || Err(format!("there is no `{name}[{number}]`: `{name}` has {count}, counted from 0")),
                |item| put_item(item, name, rest, value),
            )
        }
        (_, Some(_)) => Err(format!("`{name}` is no list")),
        (_, None) => Err(format!("`{name}` is a value, no table: nothing lies below it")),
    }
}

fn put_item(item: &mut Value, name: &str, rest: &[&str], value: &Value) -> Result<(), String> {
    match item {
        Value::Table(table) if !rest.is_empty() => put(table, rest, value),
        _ if rest.is_empty() => {
            *item = value.clone();
            Ok(())
        }
        _ => Err(format!("`{name}` is a list of values: nothing lies below them")),
    }
}

/// Values of keys that go together, as a file has them: for one key a value each, for several a list with an entry a key.
pub(super) fn tuples(keys: &[String], values: Vec<Value>) -> Result<Vec<Vec<Value>>, Complaint> {
    let tuple = |value: Value| match value {
        Value::Array(items) if keys.len() > 1 => items,
        value => vec![value],
    };
    let values: Vec<Vec<Value>> = values.into_iter().map(tuple).collect();
    if values.iter().all(|tuple| tuple.len() == keys.len()) {
        return Ok(values);
    }
    let name = keys.first().cloned().unwrap_or_default();
    let message = format!("key `{name}`: expected every value to be a list with one entry a key");
    Err(Complaint::new(name, message))
}

/// The files that a study's scenes name, read once: a scene that is written as text and read again has lost their contents.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Shelf {
    folder: PathBuf,
    files: BTreeMap<String, SceneFile>,
}

impl Shelf {
    /// An empty one for scenes whose relative paths count from here.
    pub(super) fn in_folder(folder: PathBuf) -> Self {
        Self { folder, files: BTreeMap::new() }
    }

    /// Reads what this scene names and the shelf lacks.
    pub(super) fn stock(&mut self, scene: &mut Scene) -> Result<(), LoadError> {
        for file in scene.files_mut() {
            if !self.files.contains_key(file.path()) {
                if !file.is_filled() {
                    files::fill(file, &self.folder)?;
                }
                self.files.insert(file.path().to_owned(), file.clone());
            }
        }
        Ok(())
    }

    /// Keeps what was read already for a scene.
    pub(super) fn of_scene(scene: &Scene) -> Self {
        let mut scene = scene.clone();
        let files = scene.files_mut().into_iter().map(|file| (file.path().to_owned(), file.clone()));
        Self { folder: PathBuf::new(), files: files.collect() }
    }

    /// What it holds.
    pub(super) fn files(&self) -> Vec<SceneFile> {
        self.files.values().cloned().collect()
    }

    /// Hands the scene its files, and checks what they hold.
    pub(super) fn serve(&self, scene: &mut Scene) -> Result<(), String> {
        for file in scene.files_mut() {
            if let Some(kept) = self.files.get(file.path()) {
                *file = kept.clone();
            }
        }
        scene.validate().map_err(|why| why.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spindle() -> Scene {
        files::load_scene("spindle", |_| {}).expect("built in")
    }

    fn set(settings: &[Setting<'_>]) -> Result<Scene, String> {
        set_in_scene(&spindle(), settings)
    }

    #[test]
    fn keys_that_the_trees_do_not_look_at_are_refused_and_take_effect_where_they_are_looked_at() {
        let rank = || ("orchard.tree.leaf_rank_scale", Value::String("linear".into()));
        let refused = set(&[rank()]).expect_err("refused");
        assert!(
            refused.contains(
                "`orchard.tree.leaf_rank_scale` has no effect on trees of `generator = \"trained\"`"
            ),
            "{refused}"
        );
        let by_hmt = ("orchard.generator", Value::String("hmt".into()));
        assert!(set(&[by_hmt.clone(), rank()]).is_ok());
        // What the preset has anyway is no wish.
        assert!(set(&[("orchard.tree.leaf_rank_scale", Value::String("off".into()))]).is_ok());
        assert!(set(&[by_hmt, ("orchard.training.spurs_per_m", Value::Float(3.0))]).is_err());
    }

    #[test]
    fn keys_of_rig_and_orchard_are_set() {
        let settings = [
            ("rig.scanner.height_m", Value::Float(2.0)),
            ("rig.scanner[0].model", Value::String("lms511".into())),
            ("orchard.tree.iterations", Value::Integer(8)),
            ("rig.speed_m_s", Value::Integer(2)),
        ];
        let scene = set(&settings).expect("valid");
        let mount = &scene.rig.scanners[0];
        assert_eq!((mount.height_m, mount.model.as_str(), scene.rig.speed_m_s), (2.0, "lms511", 2.0));
        assert_eq!(scene.orchard.tree.iterations, Some(8));
        assert_eq!(set(&[]), Ok(spindle()));
    }

    #[test]
    fn keys_are_set_by_json_values() {
        use serde_json::json;
        let with = |key: &str, value| scene_with(&spindle(), [(key.to_owned(), value)]);
        assert_eq!(with("orchard.trees", json!(20)).expect("valid").orchard.trees, Some(20));
        assert_eq!(with("orchard.missing", json!([3, 7])).expect("valid").orchard.layout().trees, 12);
        let why = with("orchard.treez", json!(1)).expect_err("no key").to_string();
        assert!(why.contains("did you mean `trees`?"), "{why}");
        let why = with("orchard.trees", json!(null)).expect_err("no value").to_string();
        assert!(why.contains("key `orchard.trees`"), "{why}");
    }

    #[test]
    fn a_roof_is_set_and_kept_in_the_words_of_the_present_version() {
        // Read from a file of version 1, where `forward` is what `backward` is now.
        let old = "version = 1\n[[rig.scanner]]\nroof = \"forward\"\n";
        let old = files::scene_from_text(old, |_| {}).expect("sound");
        let speed = ("rig.speed_m_s", Value::Integer(2));
        assert_eq!(set_in_scene(&old, &[speed]).expect("valid").rig.scanners, old.rig.scanners);
        for (word, sense) in [("forward", -1.0), ("backward", 1.0)] {
            let scene =
                set_in_scene(&old, &[("rig.scanner.roof", Value::String(word.into()))]).expect("valid");
            assert_eq!(scene.rig.scanners[0].angle_map(), (sense, -90.0 * sense), "{word}");
        }
    }

    #[test]
    fn a_key_that_names_nothing_is_refused_with_the_nearest() {
        let refused = |key: &str, value: Value| set(&[(key, value)]).expect_err(key);
        let number = || Value::Float(1.0);
        for (key, parts) in [
            ("rig.scanner.hight_m", ["unknown key `hight_m`", "did you mean `height_m`?"]),
            ("rig.scaner.height_m", ["unknown key `scaner`", "did you mean `scanner`?"]),
            ("rig.scanner[3].height_m", ["no `scanner[3]`", "has 1"]),
            ("rig.speed_m_s.x", ["`speed_m_s` is a value", "nothing lies below"]),
            ("orchard", ["expected a table", "found"]),
        ] {
            let why = refused(key, number());
            assert!(parts.iter().all(|part| why.contains(part)) && why.contains(key), "{why}");
        }
        let why = refused("rig.scanner.distance_m", Value::Float(-1.0));
        assert!(why.contains("positive"), "{why}");
    }

    #[test]
    fn scanners_that_a_study_does_not_look_through_are_refused_by_number() {
        for key in ["rig.scanner[1].height_m", "rig.scanner[12].model"] {
            let why = of_first_scanner(["rig.speed_m_s", key]).expect_err(key);
            assert!(why.contains(key) && why.contains("rig.scanner[0]"), "{why}");
        }
        let first = ["rig.scanner[0].height_m", "rig.scanner.height_m", "orchard.trees", "rig.scanner[x].y"];
        assert_eq!(of_first_scanner(first), Ok(()));
    }
}
