//! The deserializer.
//!
//! A deserializer of our own over the parsed, spanned document, because only so do serde's typed errors (unknown field,
//! unknown variant) reach us as data and not as a sentence to be searched.

use std::fmt;
use std::ops::Range;

use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, Error as _, Expected, IntoDeserializer,
    MapAccess, SeqAccess, Unexpected, VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::{TomlError, shown, suggestion};
use crate::table::WITH_LINE;

/// Reads a document strictly: unknown keys are refused where `T` denies them.
///
/// # Errors
/// The first error with its line.
pub fn from_toml<T: DeserializeOwned>(text: &str) -> Result<T, TomlError> {
    let document = DeTable::parse(text).map_err(|error| TomlError {
        line: error.span().map_or(0, |span| line_of(text, &span)),
        message: error.message().to_owned(),
    })?;
    let span = document.span();
    let value = Spanned::new(span, DeValue::Table(document.into_inner()));
    T::deserialize(Value(value, text)).map_err(|error| TomlError {
        line: error.span.as_ref().map_or(0, |span| line_of(text, span)),
        message: error.kind.to_string(),
    })
}

fn line_of(text: &str, span: &Range<usize>) -> usize {
    text.as_bytes().iter().take(span.start).filter(|byte| **byte == b'\n').count() + 1
}

/// Nothing that a document measures is smaller and not 0: quotients of such numbers have no bound.
const LEAST: f64 = 1e-12;

/// An error of serde's, kept as data.
#[derive(Debug)]
struct DocumentError {
    span: Option<Range<usize>>,
    kind: Problem,
}

#[derive(Debug)]
enum Problem {
    UnknownKey { found: String, valid: &'static [&'static str] },
    UnknownChoice { found: String, valid: &'static [&'static str] },
    MissingKey(&'static str),
    Mismatch { found: String, expected: String },
    Other(String),
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownKey { found, valid } => {
                write!(f, "unknown key `{}`{}", shown(found), suggestion(found, valid))
            }
            Self::UnknownChoice { found, valid } => {
                write!(f, "unknown value `{}`{}", shown(found), suggestion(found, valid))
            }
            Self::MissingKey(key) => write!(f, "the key `{key}` is missing; add it"),
            Self::Mismatch { found, expected } => write!(f, "expected {expected}, found {}", shown(found)),
            Self::Other(message) => f.write_str(message),
        }
    }
}

impl DocumentError {
    fn new(kind: Problem) -> Self {
        Self { span: None, kind }
    }

    /// Another value than a table, where one was expected.
    fn no_table(found: &DeValue<'_>, expected: &dyn Expected) -> Self {
        let number = |float: &str| float.parse().map_or(Unexpected::Other("a number"), Unexpected::Float);
        let found = match found {
            DeValue::String(text) => Unexpected::Str(text),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
                .map_or(Unexpected::Other("an integer"), Unexpected::Signed),
            DeValue::Float(float) => number(float.as_str()),
            DeValue::Boolean(boolean) => Unexpected::Bool(*boolean),
            DeValue::Datetime(_) => Unexpected::Other("a date or time"),
            DeValue::Array(_) => Unexpected::Seq,
            DeValue::Table(_) => Unexpected::Map,
        };
        Self::invalid_type(found, expected)
    }

    /// The innermost place wins: it was noted first.
    fn at(mut self, span: &Range<usize>) -> Self {
        self.span.get_or_insert_with(|| span.clone());
        self
    }
}

impl fmt::Display for DocumentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.kind.fmt(f)
    }
}

impl std::error::Error for DocumentError {}

impl serde::de::Error for DocumentError {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(Problem::Other(message.to_string()))
    }

    fn unknown_field(field: &str, expected: &'static [&'static str]) -> Self {
        Self::new(Problem::UnknownKey { found: field.to_owned(), valid: expected })
    }

    fn unknown_variant(variant: &str, expected: &'static [&'static str]) -> Self {
        Self::new(Problem::UnknownChoice { found: variant.to_owned(), valid: expected })
    }

    fn missing_field(field: &'static str) -> Self {
        Self::new(Problem::MissingKey(field))
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn serde::de::Expected) -> Self {
        let expected = expected.to_string();
        // A user's document holds tables and numbers; what they become here is our affair.
        let expected = match expected.as_str() {
            "f32" | "f64" => "a number".to_owned(),
            "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number of 0 or more".to_owned(),
            "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".to_owned(),
            own if own.starts_with("struct ") => "a table".to_owned(),
            _ => expected,
        };
        Self::new(Problem::Mismatch { found: found.to_string(), expected })
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn serde::de::Expected) -> Self {
        Self::invalid_type(found, expected)
    }
}

/// One value of the document, with the whole text.
struct Value<'i>(Spanned<DeValue<'i>>, &'i str);

impl<'de> Deserializer<'de> for Value<'_> {
    type Error = DocumentError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DocumentError> {
        let span = self.0.span();
        let visited = match self.0.into_inner() {
            DeValue::String(text) => visitor.visit_str(&text),
            DeValue::Integer(integer) => match i64::from_str_radix(integer.as_str(), integer.radix()) {
                Ok(integer) => visitor.visit_i64(integer),
                // A seed may use all 64 bits.
                Err(_) => match u64::from_str_radix(integer.as_str(), integer.radix()) {
                    Ok(integer) => visitor.visit_u64(integer),
                    Err(_) => Err(DocumentError::custom(format_args!("`{integer}` does not fit 64 bits"))),
                },
            },
            DeValue::Float(float) => match float.as_str().parse::<f64>() {
                Ok(float) if float != 0.0 && float.abs() < LEAST => Err(DocumentError::custom(format_args!(
                    "expected 0, or a number of {LEAST:e} or more in size, found {float:e}"
                ))),
                Ok(float) => visitor.visit_f64(float),
                Err(_) => Err(DocumentError::custom(format_args!("`{}` is not a number", float.as_str()))),
            },
            DeValue::Boolean(boolean) => visitor.visit_bool(boolean),
            DeValue::Datetime(datetime) => visitor.visit_string(datetime.to_string()),
            DeValue::Array(items) => visitor.visit_seq(Items(items.into_iter(), self.1)),
            DeValue::Table(table) => {
                visitor.visit_map(Entries { entries: table.into_iter(), pending: None, text: self.1 })
            }
        };
        visited.map_err(|error| error.at(&span))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DocumentError> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, DocumentError> {
        if name == WITH_LINE {
            let span = self.0.span();
            let pair = WithLine { line: Some(line_of(self.1, &span)), value: Some(self) };
            return visitor.visit_seq(pair).map_err(|error| error.at(&span));
        }
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DocumentError> {
        let span = self.0.span();
        let visited = match self.0.into_inner() {
            DeValue::String(name) => visitor.visit_enum(name.into_deserializer()),
            DeValue::Table(table) => visitor.visit_enum(Choice(table, self.1)),
            other => Err(DocumentError::new(Problem::Mismatch {
                found: other.type_str().to_owned(),
                expected: "a name or a table".to_owned(),
            })),
        };
        visited.map_err(|error| error.at(&span))
    }

    /// A struct is a table. Read as any value it could be an array too, and every struct's reader would be compiled twice.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DocumentError> {
        let (span, text) = (self.0.span(), self.1);
        let visited = match self.0.into_inner() {
            DeValue::Table(table) => {
                visitor.visit_map(Entries { entries: table.into_iter(), pending: None, text })
            }
            other => Err(DocumentError::no_table(&other, &visitor)),
        };
        visited.map_err(|error| error.at(&span))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map identifier ignored_any
    }
}

/// A value behind its line, as [`Located`](crate::Located) takes them.
struct WithLine<'i> {
    line: Option<usize>,
    value: Option<Value<'i>>,
}

impl<'de> SeqAccess<'de> for WithLine<'_> {
    type Error = DocumentError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, DocumentError> {
        if let Some(line) = self.line.take() {
            return seed.deserialize((line as u64).into_deserializer()).map(Some);
        }
        self.value.take().map(|value| seed.deserialize(value)).transpose()
    }
}

struct Items<'i>(<toml::de::DeArray<'i> as IntoIterator>::IntoIter, &'i str);

impl<'de> SeqAccess<'de> for Items<'_> {
    type Error = DocumentError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, DocumentError> {
        self.0.next().map(|item| seed.deserialize(Value(item, self.1))).transpose()
    }
}

struct Entries<'i> {
    entries: <DeTable<'i> as IntoIterator>::IntoIter,
    pending: Option<Spanned<DeValue<'i>>>,
    text: &'i str,
}

impl<'de> MapAccess<'de> for Entries<'_> {
    type Error = DocumentError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, DocumentError> {
        let Some((key, value)) = self.entries.next() else { return Ok(None) };
        self.pending = Some(value);
        let span = key.span();
        let key: &str = key.get_ref();
        seed.deserialize(key.into_deserializer()).map(Some).map_err(|error: DocumentError| error.at(&span))
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, DocumentError> {
        match self.pending.take() {
            Some(value) => seed.deserialize(Value(value, self.text)),
            None => Err(DocumentError::custom("a value was asked for before its key")),
        }
    }
}

/// An enum value written as a table of one key: `{ cylinder = { radius_m = 0.1 } }`.
struct Choice<'i>(DeTable<'i>, &'i str);

impl<'de, 'i> EnumAccess<'de> for Choice<'i> {
    type Error = DocumentError;
    type Variant = Value<'i>;

    fn variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<(T::Value, Value<'i>), DocumentError> {
        let mut entries = self.0.into_iter();
        match (entries.next(), entries.next()) {
            (Some((key, value)), None) => {
                let span = key.span();
                let name: &str = key.get_ref();
                let variant = seed
                    .deserialize(name.into_deserializer())
                    .map_err(|error: DocumentError| error.at(&span))?;
                Ok((variant, Value(value, self.1)))
            }
            _ => Err(DocumentError::custom("expected a table of exactly one key, the choice's name")),
        }
    }
}

impl<'de> VariantAccess<'de> for Value<'_> {
    type Error = DocumentError;

    fn unit_variant(self) -> Result<(), DocumentError> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, DocumentError> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, DocumentError> {
        self.deserialize_any(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DocumentError> {
        self.deserialize_struct("", fields, visitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Orchard {
        trees: u32,
        tree_spacing_m: f64,
        shape: Shape,
        #[serde(default)]
        rows: Vec<[f64; 2]>,
    }

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(rename_all = "snake_case")]
    enum Shape {
        Spindle,
        Cylinder { radius_m: f64 },
    }

    fn refusal(text: &str) -> TomlError {
        from_toml::<Orchard>(text).expect_err(text)
    }

    #[test]
    fn a_sound_document_is_read() {
        let orchard: Orchard = from_toml(
            "trees = 12\ntree_spacing_m = 2\nshape = { cylinder = { radius_m = 0.1 } }\nrows = [[1, 2.5]]\n",
        )
        .expect("sound");
        assert_eq!(
            orchard,
            Orchard {
                trees: 12,
                tree_spacing_m: 2.0,
                shape: Shape::Cylinder { radius_m: 0.1 },
                rows: vec![[1.0, 2.5]]
            }
        );
    }

    #[test]
    fn an_unknown_key_names_its_line_and_the_nearest_key() {
        let found = refusal("trees = 1\ntree_spacing = 1.5\nshape = \"spindle\"\n");
        assert_eq!(found.line, 2);
        assert_eq!(found.message, "unknown key `tree_spacing`; did you mean `tree_spacing_m`?");
    }

    #[test]
    fn a_key_like_no_other_lists_what_is_valid() {
        let found = refusal("xyz = 1\n");
        assert_eq!(found.line, 1);
        assert_eq!(found.message, "unknown key `xyz`; valid here: trees, tree_spacing_m, shape, rows");
    }

    #[test]
    fn wrong_types_and_choices_name_what_was_found_and_expected() {
        let found = refusal("trees = 1\ntree_spacing_m = \"wide\"\n");
        assert_eq!((found.line, found.message.as_str()), (2, "expected a number, found string \"wide\""));
        let found =
            from_toml::<std::collections::BTreeMap<String, Orchard>>("orchard = 3\n").expect_err("a number");
        assert_eq!((found.line, found.message.as_str()), (1, "expected a table, found integer `3`"));
        // Not one field after the other: nobody could read that.
        let found =
            from_toml::<std::collections::BTreeMap<String, Orchard>>("orchard = [3, 1.5, \"spindle\"]\n")
                .expect_err("an array");
        assert_eq!((found.line, found.message.as_str()), (1, "expected a table, found sequence"));
        let found = refusal("trees = 1\nshape = { cylinder = 0.1 }\n");
        assert_eq!((found.line, found.message.as_str()), (2, "expected a table, found floating point `0.1`"));
        let found = refusal("trees = -1\n");
        assert_eq!(
            (found.line, found.message.as_str()),
            (1, "expected a whole number of 0 or more, found integer `-1`")
        );
        let found = refusal("shape = \"spindel\"\n");
        assert_eq!(
            (found.line, found.message.as_str()),
            (1, "unknown value `spindel`; did you mean `spindle`?")
        );
        let found = refusal("trees = 1\ntree_spacing_m = 1\n");
        assert_eq!(found.message, "the key `shape` is missing; add it");
    }

    #[test]
    fn what_is_not_toml_says_where() {
        let found = refusal("trees = 1\ntrees = = 2\n");
        assert_eq!(found.line, 2, "{found:?}");
    }
}
