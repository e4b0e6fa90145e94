//! A table whose valid keys are known only once one of its values has been read.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};

use crate::TomlError;

/// The newtype by which a value asks [`from_toml`](crate::from_toml) for its line.
pub(crate) const WITH_LINE: &str = "$rowscan::with_line";

/// A value and its line.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// From 1; 0 where the document has no lines, such as JSON.
    pub line: usize,
    /// The value.
    pub value: Value,
}

/// Any value of a document.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A string.
    Text(String),
    /// An integer.
    Whole(i64),
    /// A number with a fraction or exponent.
    Number(f64),
    /// `true` or `false`.
    Flag(bool),
    /// An array.
    List(Vec<Located>),
    /// A table.
    Table(BTreeMap<String, Located>),
}

/// A table with the line of every entry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Where it begins, from 1; 0 where the document has no lines.
    pub line: usize,
    /// What it holds.
    pub entries: BTreeMap<String, Located>,
}

impl Value {
    /// What it is, for a message.
    pub fn kind(&self) -> String {
        match self {
            Self::Text(text) => format!("string \"{text}\""),
            Self::Whole(whole) => format!("integer `{whole}`"),
            Self::Number(number) => format!("number `{number}`"),
            Self::Flag(flag) => format!("`{flag}`"),
            Self::List(_) => "an array".to_owned(),
            Self::Table(_) => "a table".to_owned(),
        }
    }
}

impl Located {
    /// It as a table.
    ///
    /// # Errors
    /// It is something else.
    pub fn into_table(self) -> Result<Table, TomlError> {
        match self.value {
            Value::Table(entries) => Ok(Table { line: self.line, entries }),
            other => Err(TomlError {
                line: self.line,
                message: format!("expected a table, found {}", other.kind()),
            }),
        }
    }
}

impl<'de> Deserialize<'de> for Table {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_newtype_struct(WITH_LINE, TableVisitor)
    }
}

/// Refuses what is no table while its place is still known.
struct TableVisitor;

impl<'de> Visitor<'de> for TableVisitor {
    type Value = Table;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, pair: A) -> Result<Table, A::Error> {
        table_of(LocatedVisitor.visit_seq(pair)?)
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<Table, D::Error> {
        table_of(LocatedVisitor.visit_newtype_struct(deserializer)?)
    }
}

fn table_of<E: serde::de::Error>(found: Located) -> Result<Table, E> {
    found.into_table().map_err(|error| E::custom(error.message))
}

impl<'de> Deserialize<'de> for Located {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_newtype_struct(WITH_LINE, LocatedVisitor)
    }
}

struct LocatedVisitor;

impl<'de> Visitor<'de> for LocatedVisitor {
    type Value = Located;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }

    /// What our own deserializer gives: the line and the value.
    fn visit_seq<A: SeqAccess<'de>>(self, mut pair: A) -> Result<Located, A::Error> {
        let line: Option<u64> = pair.next_element()?;
        let value: Option<Value> = pair.next_element()?;
        let line = usize::try_from(line.unwrap_or(0)).unwrap_or(0);
        value
            .map(|value| Located { line, value })
            .ok_or_else(|| serde::de::Error::custom("a line came without its value"))
    }

    /// What a deserializer gives that knows no lines.
    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<Located, D::Error> {
        Value::deserialize(deserializer).map(|value| Located { line: 0, value })
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ValueVisitor)
    }
}

struct ValueVisitor;

impl<'de> Visitor<'de> for ValueVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_bool<E>(self, flag: bool) -> Result<Value, E> {
        Ok(Value::Flag(flag))
    }

    fn visit_i64<E>(self, whole: i64) -> Result<Value, E> {
        Ok(Value::Whole(whole))
    }

    fn visit_u64<E: serde::de::Error>(self, whole: u64) -> Result<Value, E> {
        i64::try_from(whole).map(Value::Whole).map_err(|_| E::custom(format_args!("`{whole}` is too large")))
    }

    fn visit_f64<E>(self, number: f64) -> Result<Value, E> {
        Ok(Value::Number(number))
    }

    fn visit_str<E>(self, text: &str) -> Result<Value, E> {
        Ok(Value::Text(text.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = items.next_element()? {
            list.push(item);
        }
        Ok(Value::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut table = BTreeMap::new();
        while let Some((key, value)) = entries.next_entry()? {
            table.insert(key, value);
        }
        Ok(Value::Table(table))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::from_toml;

    #[derive(serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct File {
        fault: Vec<Table>,
    }

    #[test]
    fn every_entry_keeps_its_line() {
        let text =
            "[[fault]]\nname = \"flip\"\n\n[[fault]]\nname = \"split\"\nat = { s = 2.5 }\nlist = [1, true]\n";
        let File { fault } = from_toml(text).expect("sound");
        let [first, second] = fault.as_slice() else { panic!("{fault:?}") };
        assert_eq!((first.line, first.entries["name"].line), (1, 2));
        assert_eq!((second.entries["name"].line, second.entries["at"].line), (5, 6));
        let at = second.entries["at"].clone().into_table().expect("a table");
        assert_eq!(at.entries["s"], Located { line: 6, value: Value::Number(2.5) });
        let Value::List(list) = &second.entries["list"].value else { panic!("a list") };
        assert_eq!((list[0].value.clone(), list[1].value.clone()), (Value::Whole(1), Value::Flag(true)));
    }

    #[test]
    fn json_has_no_lines_and_the_same_values() {
        let table: Table = serde_json::from_str(r#"{"name":"flip","at":{"s":2},"p":0.5}"#).expect("sound");
        assert_eq!(table.entries["p"], Located { line: 0, value: Value::Number(0.5) });
        let at = table.entries["at"].clone().into_table().expect("a table");
        assert_eq!(at.entries["s"].value, Value::Whole(2));
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        let Err(error) = from_toml::<File>("fault = [\n  3,\n]\n") else { panic!("refused") };
        assert_eq!((error.line, error.message.as_str()), (2, "expected a table, found integer `3`"));
    }
}
