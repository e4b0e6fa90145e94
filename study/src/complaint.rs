//! What is wrong with the meaning of a study file.

/// What is wrong with the meaning of a file that can be read.
#[derive(Debug)]
pub(crate) struct Complaint {
    /// The text it is about, as the file has it.
    pub about: String,
    /// What is wrong, with the remedy.
    pub message: String,
}

impl Complaint {
    pub(crate) fn new(about: impl Into<String>, message: impl Into<String>) -> Self {
        Self { about: about.into(), message: message.into() }
    }
}
