//! Values of a scene file that are out of range.

/// A parameter out of range. The message names the key, what was expected and what was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} must be {expected}, found {found}")]
pub struct ParameterError {
    /// Full key, such as `orchard.tree.iterations`.
    pub key: String,
    /// The valid values.
    pub expected: String,
    /// The value in the file.
    pub found: String,
}

impl ParameterError {
    /// Key, what was expected, what was found.
    pub fn new(key: impl Into<String>, expected: impl Into<String>, found: impl ToString) -> Self {
        Self { key: key.into(), expected: expected.into(), found: found.to_string() }
    }
}

/// `Ok` if `holds`, else the error.
///
/// # Errors
/// Always [`ParameterError`] with these words.
pub fn require(holds: bool, key: &str, expected: &str, found: impl ToString) -> Result<(), ParameterError> {
    if holds { Ok(()) } else { Err(ParameterError::new(key, expected, found)) }
}

/// `Ok` if `value` is in [`low`, `high`], else the error.
///
/// # Errors
/// A value out of range, or no number.
pub fn require_within(key: &str, value: f64, low: f64, high: f64) -> Result<(), ParameterError> {
    require((low..=high).contains(&value), key, &format!("from {low} to {high}"), value)
}
