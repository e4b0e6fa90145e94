//! Every key of the files that users write. Schema, reference page and commented files come from one source: the types that read the
//! files (their fields, defaults and documentation) and the validation that these types have (its ranges).
//!
//! ```
//! use rowscan::reference::{Document, keys};
//! let schema = Document::Rig.schema();
//! let height = keys(&schema).into_iter().find(|key| key.path() == "rig.scanner.height_m").unwrap();
//! assert_eq!((height.unit.as_deref(), height.default), (Some("m"), Some(1.6.into())));
//! assert_eq!(height.allowed.as_deref(), Some("a positive number"));
//! ```

mod commented;
mod defaults;
mod document;
mod keys;
mod page;
mod ranges;
mod tidy;
mod toml_value;
mod units;

pub use commented::commented;
pub use document::Document;
pub use keys::{Key, Kind, keys};
pub use page::markdown;
