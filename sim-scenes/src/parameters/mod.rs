//! How parameters are declared: once, in a table that gives the struct, its overrides, and the documentation.

mod source;

use schemars::{Schema, SchemaGenerator, json_schema};

pub(crate) use rowscan_vehicle::parameter::require;
pub use rowscan_vehicle::{FileError, ParameterError, SceneFile};
pub use source::{RowsError, TableSource, TextRow};
pub(crate) use source::{fields, lines};

/// One line of a parameter table, for documentation and `--explain`.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ParameterDoc {
    /// The key in a scene file.
    pub key: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Value in force.
    pub value: String,
    /// Unit, or the kind of value where it has none.
    pub unit: &'static str,
    /// Where the default comes from, and the alternatives.
    pub reason: &'static str,
}

/// A key of a table of overrides, as its schema has it.
pub(crate) struct Key {
    pub(crate) name: &'static str,
    pub(crate) meaning: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) reason: &'static str,
    pub(crate) of: fn(&mut SchemaGenerator) -> Schema,
}

/// The schema of a table of which every key may be left out: what schemars derives, without code of its own for every key.
pub(crate) fn schema_of_table(generator: &mut SchemaGenerator, meaning: &str, keys: &[Key]) -> Schema {
    let text = |lines: &str| lines.lines().map(str::trim).collect::<Vec<_>>().join("\n").trim().to_owned();
    let mut properties = serde_json::Map::new();
    for key in keys {
        let mut schema = (key.of)(generator);
        let about = [("description", text(key.meaning)), ("x-unit", key.unit.to_owned())];
        for (name, value) in about.into_iter().chain([("x-reason", key.reason.to_owned())]) {
            schema.insert(name.to_owned(), value.into());
        }
        properties.insert(key.name.to_owned(), schema.into());
    }
    json_schema!({
        "description": text(meaning),
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    })
}

/// Declares a table of parameters. Gives the struct with all values (`Default` = the table), the struct of overrides
/// (every value optional: what a scene file may hold), `Overrides::over(base)`, and `table()` for documentation.
macro_rules! parameters {
    (
        $(#[$meta:meta])* pub struct $name:ident;
        $(#[doc = $overrides_doc:literal])+ pub overrides $overrides:ident;
        $( $(#[doc = $doc:literal])+ $key:ident: $type:ty = $default:expr, $unit:literal, $reason:literal; )+
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name { $( $(#[doc = $doc])+ pub $key: $type, )+ }

        impl Default for $name {
            fn default() -> Self {
                Self { $( $key: $default, )+ }
            }
        }

        $(#[doc = $overrides_doc])+
        #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $overrides {
            $(
                $(#[doc = $doc])+
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $key: Option<$type>,
            )+
        }

        impl schemars::JsonSchema for $overrides {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($overrides).into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                let keys = [ $( $crate::parameters::Key {
                    name: stringify!($key),
                    meaning: concat!($($doc, "\n"),+),
                    unit: $unit,
                    reason: $reason,
                    of: schemars::SchemaGenerator::subschema_for::<Option<$type>>,
                }, )+ ];
                $crate::parameters::schema_of_table(generator, concat!($($overrides_doc, "\n"),+), &keys)
            }
        }

        impl $overrides {
            /// `base` with everything replaced that is set here.
            #[must_use]
            pub fn over(&self, base: $name) -> $name {
                $name { $( $key: self.$key.clone().unwrap_or(base.$key), )+ }
            }
        }

        impl $name {
            /// Overrides that make any base equal to this.
            pub fn as_overrides(&self) -> $overrides {
                $overrides { $( $key: Some(self.$key.clone()), )+ }
            }

            /// Every parameter with its value here, in the order of the declaration.
            pub fn table(&self) -> Vec<$crate::parameters::ParameterDoc> {
                vec![ $( $crate::parameters::ParameterDoc {
                    key: stringify!($key),
                    meaning: concat!($($doc),+).trim_start(),
                    value: self.$key.to_string(),
                    unit: $unit,
                    reason: $reason,
                }, )+ ]
            }
        }
    };
}
pub(crate) use parameters;

/// Declares a plain enum whose variants have names in a scene file. Gives serde, `Display` and `NAMES`.
macro_rules! choices {
    (
        $(#[$meta:meta])* pub enum $name:ident {
            $( $(#[$variant_meta:meta])* $variant:ident = $text:literal, )+
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        pub enum $name { $( $(#[$variant_meta])* #[serde(rename = $text)] $variant, )+ }

        impl $name {
            /// The names that stand for the variants in a scene file.
            pub const NAMES: &'static [&'static str] = &[$( $text, )+];
            /// All variants, in the order of [`Self::NAMES`].
            pub const ALL: &'static [Self] = &[$( Self::$variant, )+];
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(match self { $( Self::$variant => $text, )+ })
            }
        }
    };
}
pub(crate) use choices;
