//! What a look at the participants found.

/// Whether a step is acknowledged.
pub(super) enum Looked {
    Acknowledged,
    /// Not yet, and who is missing.
    Missing(String),
}
