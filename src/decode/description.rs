//! What a telegram holds, as words for people and as JSON, from one visit.

use std::fmt::Write;

use rowscan_protocol::visit::{Group, Value, Visitor};
use serde_json::{Map, Value as Json};

/// Lists of numbers up to this long are written out in words.
const SHORT_LIST: usize = 16;

/// A body that is not taken apart.
pub(super) fn opaque(bytes: usize) -> String {
    format!("opaque, {bytes} bytes")
}

/// A telegram's fields.
#[derive(Debug)]
pub(super) struct Description {
    /// `name: value unit, …`
    pub(super) words: String,
    /// A part of it is shown by its length only.
    pub(super) is_opaque: bool,
    groups: Vec<Level>,
    unit: Option<&'static str>,
    /// Long lists are written out in words as well.
    values: bool,
    json: Json,
}

/// A struct or a list that has not ended.
#[derive(Debug)]
struct Level {
    group: Group,
    /// Where its words begin.
    start: usize,
    json: Json,
    /// The field that the next value belongs to.
    field: &'static str,
    /// It has had a part.
    begun: bool,
    /// Parts so far, smallest and largest, as long as all are whole numbers.
    numbers: Option<(usize, i64, i64)>,
}

impl Description {
    pub(super) fn new(values: bool) -> Self {
        Self {
            words: String::new(),
            is_opaque: false,
            groups: Vec::new(),
            unit: None,
            values,
            json: Json::Null,
        }
    }

    /// The fields as a JSON object; null where there are none.
    pub(super) fn into_json(self) -> Json {
        self.json
    }

    /// A part of the innermost group begins.
    fn part(&mut self, number: Option<i64>) {
        let Some(level) = self.groups.last_mut() else { return };
        if level.group == Group::List {
            if level.begun {
                self.words.push_str(", ");
            }
            level.numbers = level.numbers.zip(number).map(|((count, least, most), number)| {
                if count == 0 {
                    (1, number, number)
                } else {
                    (count + 1, least.min(number), most.max(number))
                }
            });
        }
        level.begun = true;
    }

    fn put(&mut self, json: Json) {
        match self.groups.last_mut() {
            None => self.json = json,
            Some(Level { json: Json::Array(items), .. }) => items.push(json),
            Some(Level { json: Json::Object(map), field, .. }) => {
                map.insert((*field).to_owned(), json);
            }
            Some(_) => {}
        }
    }

    fn number(&mut self, text: &str) {
        self.words.push_str(text);
        if let Some(unit) = self.unit.take() {
            // A unit such as 1/100 Hz is a factor.
            let times = if unit.starts_with(|first: char| first.is_ascii_digit()) { " ×" } else { "" };
            let _ = write!(self.words, "{times} {unit}");
        }
    }
}

impl Visitor for Description {
    fn value(&mut self, value: Value<'_>) {
        self.part(match value {
            Value::Integer(number) => Some(number),
            Value::Unsigned(number) => i64::try_from(number).ok(),
            _ => None,
        });
        let json = match value {
            Value::Flag(on) => {
                let _ = write!(self.words, "{on}");
                Json::from(on)
            }
            Value::Integer(number) => {
                self.number(&number.to_string());
                Json::from(number)
            }
            Value::Unsigned(number) => {
                self.number(&number.to_string());
                Json::from(number)
            }
            Value::Real(number) => {
                self.number(&format!("{number:?}"));
                // By its shortest decimal form, so that 0.1 reads 0.1.
                number.to_string().parse::<f64>().map_or(Json::Null, Json::from)
            }
            Value::Text(text) => {
                let _ = write!(self.words, "{text:?}");
                Json::from(text)
            }
            Value::Opaque(bytes) => {
                self.is_opaque = true;
                self.words.push_str(&opaque(bytes.len()));
                Json::from(bytes.iter().map(|byte| format!("{byte:02X}")).collect::<String>())
            }
            _ => {
                self.words.push_str("none");
                Json::Null
            }
        };
        self.unit = None;
        self.put(json);
    }

    fn begin(&mut self, group: Group) {
        self.part(None);
        let start = self.words.len();
        let json = match group {
            Group::Struct => Json::Object(Map::new()),
            Group::List => Json::Array(Vec::new()),
        };
        if group == Group::List {
            self.words.push('[');
        } else if !self.groups.is_empty() {
            self.words.push('{');
        }
        let numbers = Some((0, 0, 0));
        self.groups.push(Level { group, start, json, field: "", begun: false, numbers });
    }

    fn field(&mut self, name: &'static str, unit: Option<&'static str>) {
        let is_root = self.groups.len() == 1;
        if let Some(level) = self.groups.last_mut() {
            level.field = name;
            self.words.push_str(match (level.begun, is_root) {
                (true, _) => ", ",
                (false, true) => "",
                (false, false) => " ",
            });
            level.begun = true;
        }
        let _ = write!(self.words, "{name}: ");
        self.unit = unit;
    }

    fn end(&mut self) {
        let Some(level) = self.groups.pop() else { return };
        match (level.group, level.numbers) {
            (Group::List, Some((count, least, most))) if count > SHORT_LIST && !self.values => {
                self.words.truncate(level.start);
                let _ = write!(self.words, "[{count} values, {least} to {most}]");
            }
            (Group::List, _) => self.words.push(']'),
            (Group::Struct, _) if self.groups.is_empty() => {}
            (Group::Struct, _) => self.words.push_str(if level.begun { " }" } else { "}" }),
        }
        self.put(level.json);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::device::command::visit;
    use rowscan_protocol::frame::Dialect;
    use rowscan_protocol::telegram::Telegram;

    fn described(payload: &str, values: bool) -> Description {
        let mut description = Description::new(values);
        let telegram = Telegram::parse(Dialect::A, payload.as_bytes()).unwrap();
        visit(&telegram, &mut description).unwrap().unwrap();
        description
    }

    #[test]
    fn fields_have_names_values_and_units() {
        let status = described("sRA STlms 7 0 8 12:00:00 8 01.02.24 0 0 0", false);
        let words = r#"state: 7, temperature: 0, time: "12:00:00", date: "01.02.24", lamps: [0, 0, 0]"#;
        assert_eq!(status.words, words);
        let json = serde_json::json!({
            "state": 7, "temperature": 0, "time": "12:00:00", "date": "01.02.24", "lamps": [0, 0, 0]
        });
        assert_eq!(status.into_json(), json);
        let config = described("sRA LMPscancfg 1388 1 1388 FFF92230 225510", false);
        let words = "frequency_centihz: 5000 × 1/100 Hz, \
                     sectors: [{ step: 5000 × 1/10000°, start: -450000 × 1/10000°, stop: 2250000 × 1/10000° }]";
        assert_eq!(config.words, words);
    }

    #[test]
    fn results_events_and_refusals_are_structs_too() {
        for (payload, words) in [
            ("sAN SetAccessMode 1", "result: true"),
            ("sEA LMDscandata 1", "on: true"),
            ("sMN Run", ""),
            ("sFA 3", r#"error: 3, meaning: "unknown variable""#),
        ] {
            let description = described(payload, false);
            assert_eq!(description.words, words);
            assert!(description.into_json().is_object(), "{payload}");
        }
    }

    #[test]
    fn long_lists_of_numbers_are_shown_by_length_and_extremes() {
        let scan = |values: bool| {
            let numbers: String = (0..20).map(|n| format!(" {n:X}")).collect();
            described(
                &format!(
                    "sSN LMDscandata 1 1 1 0 0 7 9 3E8 4B0 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 14{numbers} 0 0 0 0 0 0"
                ),
                values,
            )
        };
        assert!(scan(false).words.contains("values: [20 values, 0 to 19] }]"));
        assert!(scan(true).words.contains("values: [0, 1, 2, 3,"));
        // JSON has every value either way.
        for values in [false, true] {
            let json = scan(values).into_json();
            assert_eq!(json["channels16"][0]["values"].as_array().map(Vec::len), Some(20));
            assert_eq!(json["channels16"][0]["scale"], 1.0);
            assert!(json["time"].is_null());
        }
    }

    #[test]
    fn a_body_that_is_not_taken_apart_is_shown_by_its_length() {
        let field = described("sRA field003 1 A2", false);
        assert!(field.is_opaque);
        assert_eq!(field.words, "body: opaque, 4 bytes");
        assert_eq!(field.into_json()["body"], "31204132");
    }
}
