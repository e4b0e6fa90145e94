//! What stands in a `[[fault]]` table, as JSON Schema: the common keys, and of each fault its own parameters by the table of faults.

use rowscan_faults::{FAULTS, Form, Parameter};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::{Map, Value, json};

use crate::fault::HOST_PAUSE;

/// The keys that every fault has.
#[derive(JsonSchema)]
#[expect(dead_code, reason = "only its schema is used; tables are read by rowscan-faults")]
struct Common {
    /// The fault.
    #[schemars(example = &"stall")]
    name: String,
    /// How events and `after` name it; its name where left out.
    #[schemars(example = &"out")]
    id: Option<String>,
    /// The one stream or part it acts on; every one that takes it where left out.
    #[schemars(example = &"left")]
    on: Option<String>,
    /// Which way it acts; by the fault where left out.
    #[schemars(example = &"to_client")]
    direction: Option<Way>,
    /// When it begins: exactly one key, and `plus_s` beside `after`; at once where left out.
    at: Option<At>,
    /// How long it lasts: exactly one key.
    #[schemars(rename = "for")]
    lasts: Option<Lasts>,
    /// When it is over, instead of `for`: as `at`.
    until: Option<At>,
    /// From one beginning to the next: exactly one key; once where left out.
    every: Option<Lasts>,
    /// Probability of each telegram, piece, connection or datagram; of faults that have none, of each beginning. 1 where left out.
    #[schemars(range(min = 0.0, max = 1.0), example = 0.1)]
    p: Option<f64>,
    /// At most so many telegrams or connections; of other faults, beginnings.
    #[schemars(range(min = 1), example = 5)]
    count: Option<u64>,
}

/// Which way bytes go.
#[derive(JsonSchema)]
#[schemars(rename_all = "snake_case")]
#[expect(dead_code, reason = "as Common")]
enum Way {
    /// From the device to its client.
    ToClient,
    /// From the client to the device.
    ToDevice,
    /// Both.
    Both,
}

#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
#[expect(dead_code, reason = "as Common")]
struct At {
    /// Seconds of simulated time.
    #[schemars(range(min = 0.0), example = 2.5, extend("x-unit" = "s"))]
    s: Option<f64>,
    /// The scan telegram of this number on a connection, from 1.
    #[schemars(range(min = 1), example = 500)]
    scan: Option<u64>,
    /// A request of the client, by kind and name.
    #[schemars(example = &"sWN LMDscandatacfg")]
    command: Option<String>,
    /// The tractor is so far along the row.
    #[schemars(range(min = -1e6, max = 1e6), example = 6.0)]
    row_m: Option<f64>,
    /// The tractor is beside this tree, from 1.
    #[schemars(range(min = 1), example = 4)]
    tree: Option<u32>,
    /// Another fault's begin, or its end as `ID.end`.
    #[schemars(example = &"out.end")]
    after: Option<String>,
    /// Later than `after` by this.
    #[schemars(range(min = 0.0), example = 2.0)]
    plus_s: Option<f64>,
}

#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
#[expect(dead_code, reason = "as Common")]
struct Lasts {
    /// Seconds of simulated time.
    #[schemars(range(min = 0.0), example = 8.0, extend("x-unit" = "s"))]
    s: Option<f64>,
    /// Scan telegrams of the stream.
    #[schemars(range(min = 1), example = 30)]
    scans: Option<u64>,
}

/// An array of `[[fault]]` tables. A fault's own parameters carry `x-of`: which faults have them.
pub(crate) fn faults(generator: &mut SchemaGenerator) -> Schema {
    let mut common = generator.subschema_for::<Common>().to_value();
    let own: Vec<(&str, &[Parameter])> =
        FAULTS.iter().map(|fault| (fault.name, fault.parameters)).chain([(HOST_PAUSE, &[][..])]).collect();
    let mut properties = match common.get_mut("properties").map(Value::take) {
        Some(Value::Object(properties)) => properties,
        _ => Map::new(),
    };
    let shared: Vec<String> = properties.keys().cloned().collect();
    for (fault, parameter) in own.iter().flat_map(|(name, own)| own.iter().map(move |one| (name, one))) {
        let known = properties.entry(parameter.key).or_insert_with(|| json!({ "anyOf": [], "x-of": [] }));
        let form = described(parameter);
        push(known, "x-of", json!(fault));
        if !known["anyOf"].as_array().is_some_and(|forms| forms.contains(&form)) {
            push(known, "anyOf", form);
        }
    }
    properties.insert(
        "sweep".to_owned(),
        json!({
            "description": "The same fault on one scan after another, a parameter counting up: `{ KEY = [first, last] }`, of `offset` also `\"all\"`.",
            "type": "object",
            "examples": [{ "offset": "all" }],
        }),
    );
    if let Some(name) = properties.get_mut("name") {
        name["enum"] = own.iter().map(|(name, _)| *name).collect();
    }
    let rules = own.iter().map(|(name, own)| {
        let keys = own.iter().map(|one| one.key);
        let keys: Vec<&str> = shared.iter().map(String::as_str).chain(["sweep"]).chain(keys).collect();
        json!({ "if": { "properties": { "name": { "const": name } } }, "then": { "propertyNames": { "enum": keys } } })
    });
    json_schema!({
        "type": "array",
        "items": {
            "type": "object",
            "properties": properties,
            "required": ["name"],
            "additionalProperties": false,
            "allOf": rules.collect::<Vec<Value>>(),
        },
    })
}

fn push(schema: &mut Value, key: &str, value: Value) {
    if let Some(list) = schema.get_mut(key).and_then(Value::as_array_mut) {
        list.push(value);
    }
}

fn described(parameter: &Parameter) -> Value {
    let mut schema = form(parameter.form);
    schema["description"] = json!(parameter.about);
    schema
}

fn form(form: Form) -> Value {
    let number = |low: f64, high: f64| json!({ "type": "number", "minimum": low, "maximum": high });
    let whole = |low: i64, high: i64| json!({ "type": "integer", "minimum": low, "maximum": high });
    match form {
        Form::Number(low, high) => number(low, high),
        Form::Strength(low, high) => {
            let mut strength = number(low, high);
            strength["not"] = json!({ "const": 0 });
            strength
        }
        Form::Whole(low, high) => whole(low, high),
        Form::Wholes(low, high) => {
            json!({ "anyOf": [whole(low, high), { "type": "array", "items": whole(low, high) }] })
        }
        Form::Word(words) => json!({ "type": "string", "enum": words }),
        Form::Hex | Form::Text(_) => json!({ "type": "string" }),
        Form::Flag => json!({ "type": "boolean" }),
        Form::Pair(low, high) => {
            json!({ "type": "array", "items": number(low, high), "minItems": 2, "maxItems": 2 })
        }
        Form::Timed(low, high) => json!({
            "type": "array",
            "items": { "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 },
            "description": format!("Pairs of milliseconds and a number from {low} to {high}."),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_common_keys_are_those_that_are_read() {
        let mut generator = SchemaGenerator::default();
        let common = generator.subschema_for::<Common>();
        let common = generator.definitions().get("Common").cloned().unwrap_or_else(|| common.to_value());
        let keys: Vec<&String> = common["properties"].as_object().expect("keys").keys().collect();
        assert_eq!(keys, rowscan_faults::COMMON);
    }
}
