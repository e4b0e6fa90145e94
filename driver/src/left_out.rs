//! What is left out of a recording.

/// Of a recording with several streams of scans, of which none was named: the one that is read, and the others.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct StreamsLeftOut {
    /// The stream that is read: the first by name. Later conversations with the same scanner are read behind it.
    pub read: String,
    /// The others, by name.
    pub left_out: Vec<String>,
}
