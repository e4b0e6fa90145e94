//! What a look at the participants found.

/// Whether a step is acknowledged.
pub(super) enum Looked {
    Acknowledged,
    /// As it seems: looks that follow soon must find the same.
    Settling,
    /// Not yet, and who is missing.
    Missing(String),
}
