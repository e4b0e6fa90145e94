//! Files that a scene names. This crate reads no files: the caller passes the content in.

use std::borrow::Cow;
use std::sync::Arc;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A file named in a scene, by its path; relative paths count from the scene file's folder. In the scene file it is a plain string.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneFile {
    path: String,
    content: Option<Arc<[u8]>>,
}

impl SceneFile {
    /// A file that is not read yet.
    pub fn named(path: impl Into<String>) -> Self {
        Self { path: path.into(), content: None }
    }

    /// A file with its content.
    pub fn with_content(path: impl Into<String>, content: impl Into<Arc<[u8]>>) -> Self {
        Self { path: path.into(), content: Some(content.into()) }
    }

    /// Its path, as the scene has it.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Passes its content in.
    pub fn fill(&mut self, content: impl Into<Arc<[u8]>>) {
        self.content = Some(content.into());
    }

    /// True once its content has been passed in.
    pub fn is_filled(&self) -> bool {
        self.content.is_some()
    }

    /// Its bytes.
    ///
    /// # Errors
    /// [`FileError::NotRead`] before [`Self::fill`].
    pub fn bytes(&self) -> Result<&[u8], FileError> {
        self.content.as_deref().ok_or_else(|| FileError::NotRead { path: self.path.clone() })
    }

    /// Its text.
    ///
    /// # Errors
    /// Not read, or not UTF-8.
    pub fn text(&self) -> Result<&str, FileError> {
        let bytes = self.bytes()?;
        std::str::from_utf8(bytes).map_err(|error| {
            let before = bytes.get(..error.valid_up_to()).unwrap_or(&[]);
            let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
            FileError::NotText { path: self.path.clone(), line }
        })
    }
}

/// Why a file named in a scene has no usable content.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// Its content was never passed in.
    #[error("{path} has not been read")]
    NotRead {
        /// The file.
        path: String,
    },
    /// Bytes that are not UTF-8.
    #[error("{path}:{line}: text expected, found bytes that are not UTF-8")]
    NotText {
        /// The file.
        path: String,
        /// Line of the first such byte, from 1.
        line: usize,
    },
}

impl JsonSchema for SceneFile {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "SceneFile".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "x-kind": "a file's path" })
    }
}

impl Serialize for SceneFile {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.path)
    }
}

impl<'de> Deserialize<'de> for SceneFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(Self::named)
    }
}
