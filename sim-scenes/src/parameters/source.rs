//! A table of the model that a scene file names or writes out.

use std::fmt;
use std::marker::PhantomData;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A name, or rows written out. Names are looked up when the table is used, so that an unknown one is an error of
/// validation, with the key it stands at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source<Row> {
    /// A table that the program knows.
    Named(String),
    /// Row by row, as given.
    Inline(Vec<Row>),
}

impl<Row> Source<Row> {
    /// The table with this name.
    pub fn named(name: &str) -> Self {
        Self::Named(name.to_owned())
    }
}

impl<Row: fmt::Debug> fmt::Display for Source<Row> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named(name) => f.write_str(name),
            Self::Inline(rows) => write!(f, "{rows:?}"),
        }
    }
}

impl<Row: Serialize> Serialize for Source<Row> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Named(name) => serializer.serialize_str(name),
            Self::Inline(rows) => rows.serialize(serializer),
        }
    }
}

impl<'de, Row: Deserialize<'de>> Deserialize<'de> for Source<Row> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NameOrRows(PhantomData))
    }
}

struct NameOrRows<Row>(PhantomData<Row>);

impl<'de, Row: Deserialize<'de>> de::Visitor<'de> for NameOrRows<Row> {
    type Value = Source<Row>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a table, or its four rows")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<Self::Value, E> {
        Ok(Source::named(name))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, rows: A) -> Result<Self::Value, A::Error> {
        Vec::deserialize(de::value::SeqAccessDeserializer::new(rows)).map(Source::Inline)
    }
}
