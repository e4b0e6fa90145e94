//! A value of a schema as TOML, on one line.

use serde_json::Value;

/// The value as it stands behind `key = `.
pub(super) fn inline(value: &Value) -> String {
    match value {
        Value::Array(items) => format!("[{}]", items.iter().map(inline).collect::<Vec<_>>().join(", ")),
        Value::Object(map) => {
            let entries = map.iter().map(|(name, value)| format!("{} = {}", key(name), inline(value)));
            format!("{{ {} }}", entries.collect::<Vec<_>>().join(", "))
        }
        Value::String(text) => toml::Value::String(text.clone()).to_string(),
        // There is none in a schema without null.
        Value::Null => "\"\"".to_owned(),
        Value::Bool(_) | Value::Number(_) => value.to_string(),
    }
}

/// A key, in quotes where a dot or another character would mean something else.
fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) {
        name.to_owned()
    } else {
        toml::Value::String(name.to_owned()).to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_key_with_dots_stays_one_key() {
        let value = json!({ "rig.scanner.distance_m": 2.0, "plain-key_2": [1, "a"] });
        let text = inline(&value);
        assert_eq!(text, "{ \"rig.scanner.distance_m\" = 2.0, plain-key_2 = [1, \"a\"] }");
        let read: toml::Table = toml::from_str(&format!("value = {text}")).unwrap();
        assert_eq!(read["value"]["rig.scanner.distance_m"].as_float(), Some(2.0));
    }
}
