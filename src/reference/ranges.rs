//! Ranges, asked of the reader itself: each number is set to what no range holds, and the refusal says what would be valid. So a range
//! stands in one place, the validation.

use rowscan_protocol::rig::RigError;
use rowscan_scenes::scene::VERSION;
use rowscan_scenes::{Scene, SceneError, builtin};
use rowscan_sprayer::{Boom, BoomError};
use rowscan_vehicle::trajectory::DriveError;
use serde_json::{Map, Value, json};

/// Numbers that are out of most ranges.
const FAR: [f64; 2] = [-1e12, 1e12];
/// The same for whole numbers.
const FAR_WHOLE: [u64; 2] = [0, u32::MAX as u64];

/// What a reader says of a document with a number out of range: the number's path, and the values allowed.
type Reader = fn(&Value) -> Option<(String, String)>;

/// Adds to every number of a scene or rig what the reader says of its range.
pub(super) fn ask(schema: &mut Value) {
    ask_of(schema, &bases(), scene_says);
}

/// The same of a boom.
pub(super) fn ask_boom(schema: &mut Value) {
    ask_of(
        schema,
        &[json!({ "version": 1, "section": [begun(&schema["properties"]["section"]["items"])] })],
        boom_says,
    );
}

fn ask_of(schema: &mut Value, bases: &[Value], says: Reader) {
    let whole = schema.clone();
    numbers(schema, &mut Vec::new(), &mut |path, key| {
        let is_whole = key["type"] == "integer";
        let Some(words) = bases.iter().find_map(|base| refusal(&whole, base, path, (is_whole, says))) else {
            return;
        };
        if let Value::Object(map) = key {
            let ends = ends(&words);
            if !ends.is_empty() {
                map.remove("minimum");
                map.extend(ends);
            }
            map.insert("x-allowed".to_owned(), json!(words));
        }
    });
}

/// Scenes in which different parts are validated: one without a word, and every built-in one.
fn bases() -> Vec<Value> {
    let built_in = builtin::names().filter_map(builtin::text).filter_map(|text| toml::from_str(text).ok());
    [json!({ "version": VERSION })].into_iter().chain(built_in).collect()
}

/// Calls `on` with the path and schema of every number.
fn numbers(schema: &mut Value, path: &mut Vec<String>, on: &mut impl FnMut(&[String], &mut Value)) {
    let Some(Value::Object(properties)) = schema.get_mut("properties") else { return };
    for (name, key) in properties.iter_mut() {
        path.push(name.clone());
        match key["type"].as_str() {
            Some("number" | "integer") => on(path, key),
            Some("array") => key.get_mut("items").into_iter().for_each(|items| numbers(items, path, on)),
            _ => numbers(key, path, on),
        }
        path.pop();
    }
}

/// What the reader says to a number out of range.
fn refusal(
    schema: &Value,
    base: &Value,
    path: &[String],
    (is_whole, says): (bool, Reader),
) -> Option<String> {
    let far = if is_whole { FAR_WHOLE.map(|far| json!(far)) } else { FAR.map(|far| json!(far)) };
    far.iter().find_map(|far| {
        let mut document = base.clone();
        set(schema, &mut document, path, far);
        let (key, words) = says(&document)?;
        (key == path.join(".")).then_some(words)
    })
}

fn scene_says(scene: &Value) -> Option<(String, String)> {
    // As text: a reader of JSON values would be compiled for all that a scene holds, and nobody else uses it.
    let scene: Scene = serde_json::from_slice(scene.to_string().as_bytes()).ok()?;
    told(scene.validate().err()?)
}

fn boom_says(boom: &Value) -> Option<(String, String)> {
    let boom: Boom = serde_json::from_slice(boom.to_string().as_bytes()).ok()?;
    match boom.validate().err()? {
        BoomError::Value { key, expected, .. } => {
            // A section's key names the section, a nozzle's itself.
            let (key, is_of_section) = match key.split_once(" of section ") {
                Some((key, _)) => (key.to_owned(), true),
                None => (key, false),
            };
            let nozzle = boom.sections.iter().any(|section| !section.each.is_empty());
            let table = match (is_of_section, nozzle) {
                (false, _) => "",
                (true, false) => "section.",
                (true, true) => "section.nozzle.",
            };
            Some((format!("{table}{}", key.trim_start_matches("nozzle.")), expected.to_owned()))
        }
        BoomError::Valve { of, cause } => {
            let table = if of.starts_with("section") { "section.valve" } else { "valve" };
            Some((format!("{table}.{}", cause.key()), cause.expected().to_owned()))
        }
        _ => None,
    }
}

/// The key that an error is about, and the values allowed.
fn told(error: SceneError) -> Option<(String, String)> {
    Some(match error {
        SceneError::Parameter(error) | SceneError::Drive(DriveError::Road(error)) => {
            (error.key, error.expected)
        }
        SceneError::Drive(DriveError::Value { key, expected, .. }) => {
            (format!("drive.{key}"), expected.to_owned())
        }
        SceneError::Rig(error) => {
            let (key, words) = of_rig(error)?;
            (format!("rig.{key}"), words)
        }
        SceneError::TrueMount(error) => {
            let (key, words) = of_rig(error)?;
            (key.replace("scanner.", "true_mount."), words)
        }
        _ => return None,
    })
}

fn of_rig(error: RigError) -> Option<(&'static str, String)> {
    match error {
        RigError::NotPositive { key, .. } => Some((key, "a positive number".to_owned())),
        RigError::Negative { key, .. } => Some((key, "0 or more".to_owned())),
        RigError::NoShare { key, .. } => Some((key, "from 0 to 1".to_owned())),
        RigError::Outside { key, low, high, .. } => Some((key, format!("from {low} to {high}"))),
        _ => None,
    }
}

/// Sets the value at a path; tables on the way are made, with the keys that they must have.
fn set(schema: &Value, value: &mut Value, path: &[String], to: &Value) {
    let [first, rest @ ..] = path else {
        *value = to.clone();
        return;
    };
    let key = &schema["properties"][first];
    let Value::Object(map) = value else { return };
    match (rest.is_empty(), key["type"].as_str()) {
        (true, _) => {
            map.insert(first.clone(), to.clone());
        }
        (false, Some("array")) => {
            let tables = map.entry(first.clone()).or_insert_with(|| json!([]));
            if let Value::Array(tables) = tables {
                if tables.is_empty() {
                    tables.push(begun(&key["items"]));
                }
                tables.iter_mut().take(1).for_each(|table| set(&key["items"], table, rest, to));
            }
        }
        (false, _) => set(key, map.entry(first.clone()).or_insert_with(|| begun(key)), rest, to),
    }
}

/// A table with the keys that it must have.
fn begun(schema: &Value) -> Value {
    let names = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let given = |name: &str| schema["properties"][name]["examples"][0].clone();
    Value::Object(names.map(|name| (name.to_owned(), given(name))).collect())
}

/// The ends of a range, as JSON Schema says them.
fn ends(words: &str) -> Map<String, Value> {
    let pair = |text: &str, between: &str| -> Option<(f64, f64)> {
        // A unit may follow.
        let (low, high) = text.split_once(between)?;
        Some((low.trim().parse().ok()?, high.split_whitespace().next()?.parse().ok()?))
    };
    let mut ends = Map::new();
    if let Some((low, high)) = pair(words.strip_prefix("from ").unwrap_or(words), " to ") {
        ends.insert("minimum".to_owned(), json!(low));
        ends.insert("maximum".to_owned(), json!(high));
    } else if let Some((low, high)) = words.strip_prefix("above ").and_then(|words| pair(words, ", up to ")) {
        ends.insert("exclusiveMinimum".to_owned(), json!(low));
        ends.insert("maximum".to_owned(), json!(high));
    } else if let Some(low) = words.split_once(" or more").and_then(|(low, _)| low.parse::<f64>().ok()) {
        ends.insert("minimum".to_owned(), json!(low));
    } else if words.starts_with("a positive number") {
        ends.insert("exclusiveMinimum".to_owned(), json!(0));
    }
    ends
}
