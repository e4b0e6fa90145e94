//! Keys of a scene, set by name: `rig.scanner.height_m`, `orchard.tree.iterations`, `rig.scanner[1].distance_m`.

use rowscan_scenes::Scene;
use toml::{Table, Value};

use crate::config;

/// The scene with these keys set. A key into an array of tables without a number sets all of them.
///
/// The scene is written as TOML, changed there, and read again as strictly as a file: what names nothing, or holds what it may
/// not, is refused with the nearest valid key.
pub(super) fn set(scene: &Scene, settings: &[(&str, Value)]) -> Result<Scene, String> {
    let mut table = Table::try_from(scene).map_err(|cause| cause.to_string())?;
    for (key, value) in settings {
        let path: Vec<&str> = key.split('.').collect();
        put(&mut table, &path, value).map_err(|why| format!("key `{key}`: {why}"))?;
    }
    let text = toml::to_string(&table).map_err(|cause| cause.to_string())?;
    config::scene_from_text(&text).map_err(|why| {
        let keys: Vec<&str> = settings.iter().map(|(key, _)| *key).collect();
        format!("key `{}`: {why}", keys.join("`, `"))
    })
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
    // A table that is not there is made: reading the scene again says whether it may be.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn spindle() -> Scene {
        crate::config::load_scene("spindle").expect("built in")
    }

    #[test]
    fn keys_of_rig_and_orchard_are_set() {
        let settings = [
            ("rig.scanner.height_m", Value::Float(2.0)),
            ("rig.scanner[0].model", Value::String("lms511".into())),
            ("orchard.tree.iterations", Value::Integer(8)),
            ("rig.speed_m_s", Value::Integer(2)),
        ];
        let scene = set(&spindle(), &settings).expect("valid");
        let mount = &scene.rig.scanners[0];
        assert_eq!((mount.height_m, mount.model.as_str(), scene.rig.speed_m_s), (2.0, "lms511", 2.0));
        assert_eq!(scene.orchard.tree.iterations, Some(8));
        assert_eq!(set(&spindle(), &[]), Ok(spindle()));
    }

    #[test]
    fn a_key_that_names_nothing_is_refused_with_the_nearest() {
        let refused = |key: &str, value: Value| set(&spindle(), &[(key, value)]).expect_err(key);
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
}
