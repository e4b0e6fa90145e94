//! The defaults that a scene's preset gives.

use rowscan_scenes::files::scene_from_text;
use rowscan_scenes::scene::VERSION;
use serde_json::Value;

/// What a scene says that says nothing.
pub(super) fn empty_scene() -> String {
    format!("version = {VERSION}\n")
}

/// Fills in the defaults of a scene's keys that come from its preset.
pub(super) fn fill(schema: &mut Value) {
    // The scene without a word is sound; a test reads it.
    let Some(scene) = scene_from_text(&empty_scene(), |_| {}).ok() else { return };
    if let Ok(in_force) = serde_json::to_value(scene.spelled_out()) {
        of_preset(schema, &in_force);
    }
}

fn of_preset(schema: &mut Value, in_force: &Value) {
    let Some(Value::Object(properties)) = schema.get_mut("properties") else { return };
    for (name, key) in properties.iter_mut() {
        let Some(value) = in_force.get(name).filter(|value| !value.is_null()) else { continue };
        if key.get("properties").is_some() {
            of_preset(key, value);
        } else if let Value::Object(map) = key
            && !map.contains_key("default")
            && map.get("items").is_none_or(|items| items.get("properties").is_none())
        {
            map.insert("default".to_owned(), value.clone());
        }
    }
}
