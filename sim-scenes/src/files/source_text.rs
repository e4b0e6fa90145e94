//! The text of a file or of something built in, with its origin for messages.

use std::path::Path;

use serde::de::DeserializeOwned;

use super::error::LoadError;

/// A text and where it comes from.
#[derive(Clone, Debug)]
pub struct SourceText {
    /// Path, or built-in name.
    pub place: String,
    /// The content.
    pub text: String,
}

impl SourceText {
    /// The file `name`, or else the built-in of that name. `what` it should be goes into the messages, such as `scene`.
    ///
    /// # Errors
    /// Neither a file nor built in, or a file that cannot be read.
    pub fn find(
        what: &'static str,
        name: &str,
        built_in: impl Fn(&str) -> Option<&'static str>,
        names: Vec<&'static str>,
    ) -> Result<Self, LoadError> {
        let path = Path::new(name);
        if let Some(text) = built_in(name).filter(|_| !path.is_file()) {
            return Ok(Self { place: format!("built-in {what} {name}"), text: text.to_owned() });
        }
        match rowscan_files::read_text(path) {
            Ok(text) => Ok(Self { place: name.to_owned(), text }),
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => {
                Err(LoadError::Missing { what, name: name.to_owned(), built_in: names })
            }
            Err(cause) => Err(LoadError::Read { path: path.to_owned(), cause }),
        }
    }

    /// The folder that relative paths in this text start from.
    pub fn folder(&self) -> &Path {
        Path::new(&self.place).parent().unwrap_or(Path::new(""))
    }

    /// Reads the text as TOML; unknown keys are refused.
    ///
    /// # Errors
    /// The first error with its line.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, LoadError> {
        rowscan_settings::from_toml(&self.text)
            .map_err(|error| LoadError::Content { place: self.place.clone(), error })
    }
}
