//! What users write, as data: TOML with errors a user can act on (the line, what was found, what was expected, and the nearest valid key), and the table of
//! faults with their parameters ([`fault_table`]).
//!
//! ```
//! #[derive(Debug, serde::Deserialize)]
//! #[serde(deny_unknown_fields)]
//! struct Row { spacing_m: f64 }
//! let error = rowscan_settings::from_toml::<Row>("\nspacing = 3.2\n").unwrap_err();
//! assert_eq!((error.line, error.message.as_str()), (2, "unknown key `spacing`; did you mean `spacing_m`?"));
//! ```

mod de;
mod error;
pub mod fault_table;
mod table;

pub use de::from_toml;
pub use error::{TomlError, suggestion};
pub use table::{Located, Table, Value};
