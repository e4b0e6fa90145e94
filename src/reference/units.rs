//! Units: said where a key is declared, else by the end of its name.

use serde_json::{Value, json};

/// Endings of names and the units they say; the first that fits counts.
const ENDINGS: &[(&str, &str)] = &[
    ("_m_s2", "m/s²"),
    ("_m_s", "m/s"),
    ("_l_min", "l/min"),
    ("_bar", "bar"),
    ("_mm_h", "mm/h"),
    ("_g_m3", "g/m³"),
    ("_per_m2", "1/m²"),
    ("_per_m", "1/m"),
    ("_cm2", "cm²"),
    ("_m2", "m²"),
    ("_um", "µm"),
    ("_deg", "°"),
    ("_hz", "Hz"),
    ("_ms", "ms"),
    ("_s", "s"),
    ("_m", "m"),
];

/// Adds `x-unit` to every number whose unit is known.
pub(super) fn add(schema: &mut Value) {
    if let Some(Value::Object(properties)) = schema.get_mut("properties") {
        for (name, key) in properties {
            let is_number = matches!(key["type"].as_str(), Some("number" | "integer"));
            let by_name = ENDINGS.iter().find(|(ending, _)| name.ends_with(ending)).map(|(_, unit)| *unit);
            let said = key["x-unit"].as_str().filter(|unit| *unit != "1").map(str::to_owned);
            let unit = said.or_else(|| by_name.map(str::to_owned)).filter(|_| is_number);
            if let Value::Object(map) = key {
                map.remove("x-unit");
                map.extend(unit.map(|unit| ("x-unit".to_owned(), json!(unit))));
            }
            add(key);
        }
    }
    if let Some(items) = schema.get_mut("items") {
        add(items);
    }
}
