//! A table of the model that a scene file names, writes out, or leaves to a file of its own.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use rowscan_vehicle::{FileError, SceneFile};

/// A name, or rows written out here or in a file. Names are looked up and files read when the table is used, so that a wrong one is an
/// error of validation, with the key it stands at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TableSource<Row> {
    /// A table that the program knows.
    Named(String),
    /// Row by row, as given.
    Inline(Vec<Row>),
    /// `{ file = "PATH" }`: one row a line, `#` starts a comment.
    File(SceneFile),
}

/// A row of a table that can stand on a line of text.
pub trait TextRow: Clone {
    /// What a line should be, for messages.
    const EXPECTED: &'static str;

    /// Reads a line without comment and outer blanks. None if it is not a row of the table.
    fn read(line: &str) -> Option<Self>;
}

impl TextRow for String {
    const EXPECTED: &'static str = "signs";

    fn read(line: &str) -> Option<Self> {
        Some(line.split_whitespace().collect())
    }
}

impl TextRow for Vec<f64> {
    const EXPECTED: &'static str = "numbers";

    fn read(line: &str) -> Option<Self> {
        fields(line).map(|field| field.parse().ok()).collect()
    }
}

impl TextRow for Vec<u32> {
    const EXPECTED: &'static str = "whole numbers";

    fn read(line: &str) -> Option<Self> {
        fields(line).map(|field| field.parse().ok()).collect()
    }
}

/// The fields of a line: separated by blanks, commas or semicolons.
pub(crate) fn fields(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| c.is_whitespace() || c == ',' || c == ';').filter(|field| !field.is_empty())
}

/// Numbered lines that hold something: without comments, from 1.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let bare = |line: &str| -> usize { line.find('#').unwrap_or(line.len()) };
    (1..)
        .zip(text.lines())
        .map(move |(number, line)| (number, line.get(..bare(line)).unwrap_or(line).trim()))
        .filter(|(_, line)| !line.is_empty())
}

impl<Row> TableSource<Row> {
    /// The table with this name.
    pub fn named(name: &str) -> Self {
        Self::Named(name.to_owned())
    }

    /// The file it stands in, if it does.
    pub fn file_mut(&mut self) -> Option<&mut SceneFile> {
        match self {
            Self::File(file) => Some(file),
            Self::Named(_) | Self::Inline(_) => None,
        }
    }
}

impl<Row: TextRow> TableSource<Row> {
    /// The rows where they are written out here or in a file; the name where the table has one.
    ///
    /// # Errors
    /// A file that was not read, or a line that is not a row of the table.
    pub fn rows(&self) -> Result<Result<Cow<'_, [Row]>, &str>, RowsError> {
        match self {
            Self::Named(name) => Ok(Err(name)),
            Self::Inline(rows) => Ok(Ok(Cow::Borrowed(rows))),
            Self::File(file) => {
                let row = |(number, line): (usize, &str)| {
                    Row::read(line).ok_or_else(|| RowsError::Line {
                        path: file.path().to_owned(),
                        line: number,
                        expected: Row::EXPECTED,
                        found: line.to_owned(),
                    })
                };
                lines(file.text()?).map(row).collect::<Result<Vec<Row>, _>>().map(|rows| Ok(Cow::Owned(rows)))
            }
        }
    }
}

/// Why a file holds no table.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RowsError {
    /// The file was not read, or is not text.
    #[error(transparent)]
    File(#[from] FileError),
    /// A line is not a row of the table.
    #[error("{path}:{line}: {expected} expected, found `{found}`")]
    Line {
        /// The file.
        path: String,
        /// The line, from 1.
        line: usize,
        /// What a row is made of.
        expected: &'static str,
        /// The value found.
        found: String,
    },
}

impl<Row: fmt::Debug> fmt::Display for TableSource<Row> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named(name) => f.write_str(name),
            Self::Inline(rows) => write!(f, "{rows:?}"),
            Self::File(file) => write!(f, "{{ file = {:?} }}", file.path()),
        }
    }
}

impl<Row: JsonSchema> JsonSchema for TableSource<Row> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("TableSource_of_{}", Row::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "anyOf": [
                { "type": "string" },
                { "type": "array", "items": generator.subschema_for::<Row>() },
                { "type": "object", "properties": { FILE: { "type": "string" } }, "required": [FILE], "additionalProperties": false },
            ],
            "x-kind": "a table's name, its rows, or { file = \"PATH\" }",
        })
    }
}

impl<Row: Serialize> Serialize for TableSource<Row> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Named(name) => serializer.serialize_str(name),
            Self::Inline(rows) => rows.serialize(serializer),
            Self::File(file) => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry(FILE, file)?;
                map.end()
            }
        }
    }
}

const FILE: &str = "file";

impl<'de, Row: Deserialize<'de>> Deserialize<'de> for TableSource<Row> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NameOrRows(PhantomData))
    }
}

struct NameOrRows<Row>(PhantomData<Row>);

impl<'de, Row: Deserialize<'de>> de::Visitor<'de> for NameOrRows<Row> {
    type Value = TableSource<Row>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a table, its rows, or { file = \"PATH\" }")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<Self::Value, E> {
        Ok(TableSource::named(name))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, rows: A) -> Result<Self::Value, A::Error> {
        Vec::deserialize(de::value::SeqAccessDeserializer::new(rows)).map(TableSource::Inline)
    }

    fn visit_map<A: de::MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut file = None;
        while let Some(key) = map.next_key::<String>()? {
            if key != FILE {
                return Err(de::Error::unknown_field(&key, &[FILE]));
            }
            file = Some(map.next_value()?);
        }
        file.map(TableSource::File).ok_or_else(|| de::Error::missing_field(FILE))
    }
}
