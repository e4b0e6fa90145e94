//! From what serde's types accept to what a TOML file holds: no null, and documentation without the marks that rustdoc needs.

use serde_json::{Map, Value, json};

/// True in the schema of a table that is not there unless it is written.
pub(super) const OPTIONAL: &str = "x-optional";

/// Keys under which data stand and no schemas.
const DATA: &[&str] = &["default", "examples", "const", "enum", "required", "x-of"];

/// Tidies a schema and all within.
pub(super) fn tidy(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(tidy),
        Value::Object(map) => {
            without_null(map);
            for (key, value) in map.iter_mut() {
                match (key.as_str(), value) {
                    ("description", Value::String(text)) => *text = plain(text),
                    (key, value) if !DATA.contains(&key) => tidy(value),
                    _ => {}
                }
            }
            map.remove("format");
            table(map);
        }
        _ => {}
    }
}

/// TOML has no null: what may be null may be left out.
fn without_null(map: &mut Map<String, Value>) {
    let is_null = |one: &Value| *one == json!({ "type": "null" }) || one.is_null() || *one == json!("null");
    if map.get("default").is_some_and(Value::is_null) {
        map.remove("default");
    }
    for key in ["type", "enum"] {
        let Some(Value::Array(all)) = map.get_mut(key) else { continue };
        all.retain(|one| !is_null(one));
        if let ("type", [one]) = (key, all.as_slice()) {
            let one = one.clone();
            map.insert(key.to_owned(), one);
            // A table that may be null is not there by default.
            if map.contains_key("properties") {
                map.insert(OPTIONAL.to_owned(), json!(true));
            }
        }
    }
    let Some(Value::Array(all)) = map.get_mut("anyOf") else { return };
    let before = all.len();
    all.retain(|one| !is_null(one));
    if all.len() == before {
        return;
    }
    map.insert(OPTIONAL.to_owned(), json!(true));
    if let Some(Value::Array(all)) = map.get("anyOf")
        && let [Value::Object(only)] = all.as_slice()
    {
        let only = only.clone();
        map.remove("anyOf");
        for (key, value) in only {
            map.entry(key).or_insert(value);
        }
    }
}

/// A table's default is told by its keys; a list of tables that is empty by default is optional.
fn table(map: &mut Map<String, Value>) {
    let is_table = map.contains_key("properties");
    let holds_tables = map.get("items").is_some_and(|items| items.get("properties").is_some());
    if is_table || holds_tables {
        let default = map.remove("default");
        if holds_tables && !matches!(default, Some(Value::Array(tables)) if !tables.is_empty()) {
            map.insert(OPTIONAL.to_owned(), json!(true));
        }
    }
}

/// Documentation as it reads outside rustdoc: one paragraph, links and escapes resolved.
fn plain(text: &str) -> String {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let text = text.replace("\\[", "[").replace("\\]", "]");
    let mut plain = text.replace("[`", "`").replace("`]", "`");
    for tag in [" [ASM]", " [MEM]", " [DER]", " [REC]"] {
        plain = plain.replace(tag, "");
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_be_null_may_be_left_out() {
        let mut schema = json!({
            "properties": {
                "speed": { "type": ["number", "null"], "default": null, "format": "double" },
                "stops": { "type": ["object", "null"], "properties": {} },
                "road": { "description": "Ground, see [`Road`].", "anyOf": [{ "type": "object", "properties": {} }, { "type": "null" }] },
                "legs": { "type": "array", "items": { "properties": {} }, "default": [] },
                "scanner": { "type": "array", "items": { "properties": {} }, "default": [{}] },
            }
        });
        tidy(&mut schema);
        assert_eq!(
            schema["properties"],
            json!({
                "speed": { "type": "number" },
                "stops": { "type": "object", "properties": {}, "x-optional": true },
                "road": { "description": "Ground, see `Road`.", "type": "object", "properties": {}, "x-optional": true },
                "legs": { "type": "array", "items": { "properties": {} }, "x-optional": true },
                "scanner": { "type": "array", "items": { "properties": {} } },
            })
        );
    }
}
