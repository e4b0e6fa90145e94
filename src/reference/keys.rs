//! A schema as a list of keys.

use serde_json::Value;

use super::tidy::OPTIONAL;

/// What stands at a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A value.
    Value,
    /// A table.
    Table,
    /// A list of tables.
    Tables,
}

/// One key of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// The table that it stands in, such as `rig.scanner`; empty for the file itself.
    pub table: String,
    /// Its name there.
    pub name: String,
    /// What stands there.
    pub kind: Kind,
    /// What it means.
    pub meaning: String,
    /// Why its default is what it is, if anyone says so.
    pub reason: Option<String>,
    /// What it takes: `number`, `integer`, `text`, …
    pub takes: String,
    /// The unit of a number.
    pub unit: Option<String>,
    /// The value in force where it is left out.
    pub default: Option<Value>,
    /// A value to begin with, where there is no default.
    pub example: Option<Value>,
    /// The range of a number, in words.
    pub allowed: Option<String>,
    /// The names that it takes, with what each means.
    pub choices: Vec<(String, String)>,
    /// It must be given.
    pub required: bool,
    /// Neither it nor what is in it is there unless it is written.
    pub optional: bool,
    /// The faults that have it, of a fault's own parameter.
    pub of_faults: bool,
}

impl Key {
    /// Its full name: `rig.scanner.height_m`.
    pub fn path(&self) -> String {
        join(&self.table, &self.name)
    }
}

fn join(table: &str, name: &str) -> String {
    if table.is_empty() { name.to_owned() } else { format!("{table}.{name}") }
}

/// Every key, table by table: a table's values, then the tables within.
pub fn keys(schema: &Value) -> Vec<Key> {
    let mut keys = Vec::new();
    collect("", schema, false, &mut keys);
    keys
}

fn collect(table: &str, schema: &Value, optional: bool, keys: &mut Vec<Key>) {
    let Some(properties) = schema["properties"].as_object() else { return };
    let required = |name: &str| {
        schema["required"].as_array().is_some_and(|all| all.iter().any(|one| one.as_str() == Some(name)))
    };
    let key = |name: &String, schema: &Value| Key {
        required: required(name),
        ..key(table, name, schema, optional)
    };
    let (values, tables): (Vec<Key>, Vec<Key>) =
        properties.iter().map(|(name, schema)| key(name, schema)).partition(|key| key.kind == Kind::Value);
    keys.extend(values);
    for key in tables {
        let within = &properties[&key.name];
        let within = if key.kind == Kind::Tables { &within["items"] } else { within };
        let (path, optional) = (key.path(), key.optional);
        keys.push(key);
        collect(&path, within, optional, keys);
    }
}

fn key(table: &str, name: &str, schema: &Value, within_optional: bool) -> Key {
    let text = |key: &str| schema[key].as_str().map(str::to_owned);
    let kind = if schema.get("properties").is_some() {
        Kind::Table
    } else if schema["items"].get("properties").is_some() {
        Kind::Tables
    } else {
        Kind::Value
    };
    Key {
        table: table.to_owned(),
        name: name.to_owned(),
        kind,
        meaning: text("description").unwrap_or_default(),
        reason: text("x-reason"),
        takes: takes(schema),
        unit: text("x-unit"),
        default: schema.get("default").cloned(),
        example: schema["examples"].get(0).cloned(),
        allowed: text("x-allowed").or_else(|| range(schema)),
        choices: choices(schema),
        required: false,
        optional: within_optional || (kind != Kind::Value && schema[OPTIONAL] == true),
        of_faults: schema.get("x-of").is_some(),
    }
}

/// What a value is, in words.
fn takes(schema: &Value) -> String {
    if let Some(words) = schema["x-kind"].as_str() {
        return words.to_owned();
    }
    if !choices(schema).is_empty() {
        return "one of its names".to_owned();
    }
    let plain = |kind: &str| match kind {
        "string" => "text".to_owned(),
        "boolean" => "`true`, `false`".to_owned(),
        "array" => match &schema["items"] {
            Value::Object(_) => format!("list of {}", takes(&schema["items"])),
            _ => "list".to_owned(),
        },
        "object" => "table".to_owned(),
        other => other.to_owned(),
    };
    match (&schema["type"], schema["anyOf"].as_array()) {
        (Value::String(kind), _) => plain(kind),
        (_, Some(ways)) => ways.iter().map(takes).collect::<Vec<_>>().join(", or "),
        _ => "any value".to_owned(),
    }
}

fn choices(schema: &Value) -> Vec<(String, String)> {
    let name = |value: &Value| value.as_str().map(str::to_owned);
    let told = |one: &Value| {
        let meaning = one["description"].as_str().unwrap_or_default().to_owned();
        let names = one["enum"].as_array().cloned().unwrap_or_else(|| vec![one["const"].clone()]);
        names.iter().filter_map(name).map(|name| (name, meaning.clone())).collect::<Vec<_>>()
    };
    match (schema["oneOf"].as_array(), schema["enum"].as_array()) {
        (Some(all), _) => all.iter().flat_map(told).collect(),
        (None, Some(names)) => names.iter().filter_map(name).map(|name| (name, String::new())).collect(),
        (None, None) => Vec::new(),
    }
}

/// A range by its ends, where nobody says it in words.
fn range(schema: &Value) -> Option<String> {
    let end = |key: &str| schema[key].as_f64();
    match (end("minimum"), end("maximum"), end("exclusiveMinimum")) {
        (Some(low), Some(high), _) if low == high => Some(format!("{low}")),
        (Some(low), Some(high), _) => Some(format!("from {low} to {high}")),
        (Some(low), None, _) => Some(format!("{low} or more")),
        (None, Some(high), Some(low)) => Some(format!("above {low}, up to {high}")),
        (None, None, Some(low)) => Some(format!("above {low}")),
        (None, Some(high), None) => Some(format!("up to {high}")),
        (None, None, None) => None,
    }
}
