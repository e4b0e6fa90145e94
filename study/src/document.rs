//! Study files: TOML, read strictly, with the line in every complaint.

use std::path::{Path, PathBuf};

use rowscan_scenes::Scene;
use rowscan_scenes::files::{self, LoadError, TomlError, Warning};
use serde::de::DeserializeOwned;

use super::settings::Shelf;
use crate::complaint::Complaint;

/// Why a file is no study.
#[derive(Debug, thiserror::Error)]
pub enum StudyFileError {
    /// It cannot be read.
    #[error("cannot read the study {path}: {cause}")]
    Read {
        /// The file.
        path: String,
        /// What the system said.
        #[source]
        cause: std::io::Error,
    },
    /// It is not what it should be.
    #[error("{path}:{}: {}", trouble.line, trouble.message)]
    Content {
        /// The file.
        path: String,
        /// What is wrong, and where.
        trouble: TomlError,
    },
    /// Its scene, or a file that the scene names, cannot be used.
    #[error("the study's scene: {0}")]
    Scene(#[from] LoadError),
}

/// A study file's text.
pub(super) struct Document<'a> {
    path: &'a Path,
    text: String,
}

impl<'a> Document<'a> {
    pub(super) fn open(path: &'a Path) -> Result<Self, StudyFileError> {
        let text = rowscan_files::read_text(path)
            .map_err(|cause| StudyFileError::Read { path: path.display().to_string(), cause })?;
        Ok(Self { path, text })
    }

    /// A file that ships with the program.
    pub(super) fn built_in(name: &'a str, text: &str) -> Self {
        Self { path: Path::new(name), text: text.to_owned() }
    }

    pub(super) fn parse<T: DeserializeOwned>(&self) -> Result<T, StudyFileError> {
        files::from_toml(&self.text).map_err(|trouble| self.content(trouble))
    }

    /// The scene it departs from, a file beside it or a built-in, and the shelf of that scene's files. `tell` hears what the user should know of it.
    pub(super) fn scene(
        &self,
        name: &str,
        tell: impl FnMut(Warning),
    ) -> Result<(Scene, Shelf), StudyFileError> {
        let beside = self.path.parent().map(|folder| folder.join(name)).filter(|beside| beside.is_file());
        let place = beside.unwrap_or_else(|| PathBuf::from(name));
        let scene = files::load_scene(place.to_str().unwrap_or(name), tell)?;
        let folder = place.parent().unwrap_or(Path::new("")).to_owned();
        Ok((scene, Shelf::in_folder(folder)))
    }

    /// A complaint with the line that holds what it is about.
    pub(super) fn refuse(&self, Complaint { about, message }: Complaint) -> StudyFileError {
        let quoted = format!("\"{about}\"");
        let holds = |line: &str| line.contains(&quoted) || line.trim_start().starts_with(about.as_str());
        let line = self.text.lines().position(holds).map_or(0, |index| index + 1);
        self.content(TomlError { line, message })
    }

    fn content(&self, trouble: TomlError) -> StudyFileError {
        StudyFileError::Content { path: self.path.display().to_string(), trouble }
    }
}
