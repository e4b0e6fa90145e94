//! What a channel of decoded messages holds.

/// The messages of a channel.
#[derive(Clone, Copy, Debug)]
pub struct Schema {
    /// What its topic ends in.
    pub topic: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
    /// The language of text and messages.
    pub language: Language,
}

/// In what language messages are described and written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Language {
    /// JSON Schema and JSON.
    #[default]
    Json,
    /// ROS message definitions and CDR, as ROS 2 has them.
    Ros2,
}

impl Language {
    /// How MCAP and Foxglove call the language of a schema.
    pub fn of_schema(self) -> &'static str {
        match self {
            Self::Json => "jsonschema",
            Self::Ros2 => "ros2msg",
        }
    }

    /// The same of a message.
    pub fn of_messages(self) -> &'static str {
        match self {
            Self::Json => "json",
            Self::Ros2 => "cdr",
        }
    }
}
