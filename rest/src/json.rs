//! Values of variables as JSON and back.

use rowscan_protocol::device::variable::{Kind, Part, Value, Variable};
use serde_json::{Map, Value as Json, json};

use crate::answer::Status;

/// The value of a variable: an object of its parts, or the one part it has.
pub(crate) fn of_value(variable: &Variable, value: &[Value]) -> Json {
    let mut json = if variable.is_struct() { Json::Object(Map::new()) } else { Json::Null };
    for (part, value) in variable.parts.iter().zip(value) {
        let told = match value {
            Value::Number(number) if part.kind == Kind::Flag => json!(*number != 0),
            Value::Number(number) => json!(number),
            Value::Address(address) => json!(address),
            Value::Text(text) => json!(text),
        };
        *place(&mut json, part.key) = told;
    }
    json
}

/// The place of a path such as `ScanRange.aRange.0.udiAngleRes`, made where it is not there yet. An empty one is the whole.
fn place<'a>(json: &'a mut Json, path: &str) -> &'a mut Json {
    path.split('.').filter(|step| !step.is_empty()).fold(json, |json, step| match step.parse::<usize>() {
        Ok(number) => {
            if !json.is_array() {
                *json = Json::Array(Vec::new());
            }
            let Json::Array(list) = json else { unreachable!("made above") };
            while list.len() <= number {
                list.push(Json::Null);
            }
            &mut list[number]
        }
        Err(_) => {
            if !json.is_object() {
                *json = Json::Object(Map::new());
            }
            &mut json[step]
        }
    })
}

/// The value that a client has written.
///
/// # Errors
/// Which part does not fit, by its kind: of another type, beyond the range, too long.
pub(crate) fn to_value(variable: &Variable, json: &Json) -> Result<Vec<Value>, Status> {
    variable.parts.iter().map(|part| part_of(part, json)).collect()
}

fn part_of(part: &Part, json: &Json) -> Result<Value, Status> {
    let steps = part.key.split('.').filter(|step| !step.is_empty());
    let mut found = json;
    for step in steps {
        let next = step.parse::<usize>().map_or_else(|_| found.get(step), |number| found.get(number));
        found = next.ok_or(Status::InvalidData)?;
    }
    let value = match part.kind {
        Kind::Flag => Value::Number(found.as_bool().ok_or(Status::InvalidData)?.into()),
        Kind::Number { .. } | Kind::Azimuth => Value::Number(whole(found)?),
        Kind::Address => {
            let list = found.as_array().ok_or(Status::InvalidData)?;
            let bytes: [&Json; 4] =
                list.iter().collect::<Vec<_>>().try_into().map_err(|_| Status::OutOfBounds)?;
            let mut address = [0; 4];
            for (byte, told) in address.iter_mut().zip(bytes) {
                *byte = u8::try_from(whole(told)?).map_err(|_| Status::OutOfRange)?;
            }
            Value::Address(address)
        }
        Kind::Text(_) => Value::Text(found.as_str().ok_or(Status::InvalidData)?.to_owned()),
    };
    match (part.kind.takes(&value), part.kind) {
        (true, _) => Ok(value),
        (false, Kind::Text(_)) => Err(Status::OutOfBounds),
        (false, _) => Err(Status::OutOfRange),
    }
}

/// A whole number; a float is of another type, even 2.0.
fn whole(json: &Json) -> Result<i64, Status> {
    if json.is_u64() && json.as_i64().is_none() {
        return Err(Status::OutOfRange);
    }
    json.as_i64().ok_or(Status::InvalidData)
}
