//! The file of one row: four lines. What it is, what the row depends on, the fingerprint of the row, the row with its notes; each but the second of little length.

use std::io;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::json;

use super::Depends;
use crate::fingerprint;

/// The first line.
const FORMAT: &str = "rowscan row 2";

/// The second line.
pub(super) fn key(study: &str, build: &str, depends: Depends) -> String {
    json!({ "study": study, "build": build, "depends": depends.into_value() }).to_string()
}

/// The bytes of a row.
///
/// # Errors
/// A row that would not be read back as it is, such as one that holds a number without end.
pub(super) fn written<T: Serialize + DeserializeOwned + PartialEq>(
    key: &str,
    row: &T,
) -> io::Result<Vec<u8>> {
    let text = serde_json::to_string(row)?;
    if serde_json::from_str::<T>(&text).ok().as_ref() != Some(row) {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "a row holds what no file can"));
    }
    let check = fingerprint::of_content(text.as_bytes());
    Ok(format!("{FORMAT}\n{key}\n{check}\n{text}\n").into_bytes())
}

/// The row that these bytes hold, if it is the one of `key`.
///
/// # Errors
/// Why it cannot be used.
pub(super) fn read<T: DeserializeOwned>(bytes: &[u8], key: &str) -> Result<T, &'static str> {
    let text = std::str::from_utf8(bytes).map_err(|_| "is no row of a study")?;
    let mut lines = text.split('\n');
    let mut line = || lines.next().unwrap_or_default();
    if line() != FORMAT {
        return Err("is no row of a study");
    }
    if !text.ends_with('\n') {
        return Err("is cut off");
    }
    if line() != key {
        return Err("holds a row that depends on something else");
    }
    let (check, row) = (line(), line());
    if check != fingerprint::of_content(row.as_bytes()) {
        return Err("is damaged");
    }
    serde_json::from_str(row).map_err(|_| "holds a row in another form")
}
