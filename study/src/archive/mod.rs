//! Results of finished rows, kept in a folder for the next study that has the same rows.
//!
//! A row is found again by all that it depends on ([`Depends`]): the scene as it grows and is driven past, its files, the scanner, the calibration by its
//! content, the study's own settings, and the program that did it. That text stands in the row's file in full and is compared in full, so a row of another
//! scene, calibration or program is never an answer. What cannot be read, or was changed, is told and done anew.
//!
//! Every study asks for its rows here, by [`Archive::row`]; nothing is kept where the user names no folder ([`Archive::none`]).

mod depends;
mod entry;
mod folder;

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use serde::Serialize;
use serde::de::DeserializeOwned;

pub use depends::Depends;
pub use folder::MOST_BYTES;

use folder::{Folder, Found};

use crate::notes::RowNotes;

/// A folder that could not be used to keep rows in.
#[derive(Debug, thiserror::Error)]
#[error("{folder}: rows cannot be kept there: {cause}")]
pub struct ArchiveError {
    /// The folder.
    folder: String,
    /// What the system said.
    cause: std::io::Error,
}

/// Where finished rows are kept and found again. Threads share it.
#[derive(Debug)]
pub struct Archive {
    /// None: nothing is kept.
    folder: Option<Mutex<Folder>>,
    /// The program.
    build: String,
    tally: Mutex<Tally>,
}

/// What became of a study's rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Rows that were there.
    pub found: usize,
    /// Rows that were done.
    pub done: usize,
    /// Kept rows that could not be used, and were done anew.
    pub spoilt: usize,
    /// The first of them, and why.
    pub first_spoilt: Option<String>,
    /// Rows that could not be kept.
    pub lost: usize,
    /// Why not the first of them.
    pub first_lost: Option<String>,
    /// What the estimates of all rows say of themselves.
    pub notes: RowNotes,
}

impl Archive {
    /// Keeps nothing.
    pub fn none() -> Self {
        Self { folder: None, build: String::new(), tally: Mutex::default() }
    }

    /// Keeps rows in `folder`, which is made if it is not there, up to `most_bytes`: the oldest rows make room for new ones. `build` is any text that differs
    /// between programs whose results may differ.
    ///
    /// # Errors
    /// A folder that cannot be made or listed.
    pub fn open(folder: &Path, build: String, most_bytes: u64) -> Result<Self, ArchiveError> {
        let opened = Folder::open(folder, most_bytes)
            .map_err(|cause| ArchiveError { folder: folder.display().to_string(), cause })?;
        Ok(Self { folder: Some(Mutex::new(opened)), build, tally: Mutex::default() })
    }

    /// What became of the rows that were asked for.
    pub fn tally(&self) -> Tally {
        self.tally.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The row of a study that depends on `depends`: the kept one, or else what `work` gives, which is kept then. A row that depends on something unknown is
    /// done and not kept. `work` notes what its estimates say of themselves; the notes are kept with the row, and those of all rows are in the [`Tally`].
    ///
    /// # Errors
    /// Those of `work`: they are not kept.
    pub fn row<T, E>(
        &self,
        study: &str,
        depends: impl Fn() -> Option<Depends>,
        work: impl FnOnce(&mut RowNotes) -> Result<T, E>,
    ) -> Result<T, E>
    where
        T: Serialize + DeserializeOwned + PartialEq,
    {
        let (row, notes) = self.noted(study, depends, || {
            let mut notes = RowNotes::default();
            Ok((work(&mut notes)?, notes))
        })?;
        self.note(|tally| tally.notes += &notes);
        Ok(row)
    }

    fn noted<T, E>(
        &self,
        study: &str,
        depends: impl Fn() -> Option<Depends>,
        work: impl FnOnce() -> Result<(T, RowNotes), E>,
    ) -> Result<(T, RowNotes), E>
    where
        T: Serialize + DeserializeOwned + PartialEq,
    {
        let Some(folder) = &self.folder else { return work() };
        let key = || depends().map(|depends| entry::key(study, &self.build, depends));
        let Some(wanted) = key() else { return work() };
        let path = folder.lock().unwrap_or_else(PoisonError::into_inner).path(&wanted);
        match folder::look(&path) {
            Found::Nothing => {}
            Found::Bytes(bytes) => match entry::read(&bytes, &wanted) {
                Ok(row) => {
                    self.note(|tally| tally.found += 1);
                    return Ok(row);
                }
                Err(why) => self.note_spoilt(&path, why),
            },
            Found::Unreadable(why) => self.note_spoilt(&path, &why),
        }
        let row = work()?;
        self.note(|tally| tally.done += 1);
        // A file that changed meanwhile: nobody knows which of both the row saw.
        if key().as_ref() == Some(&wanted) {
            let kept = entry::written(&wanted, &row)
                .and_then(|bytes| folder.lock().unwrap_or_else(PoisonError::into_inner).keep(&path, &bytes));
            if let Err(cause) = kept {
                self.note(|tally| {
                    tally.lost += 1;
                    tally.first_lost.get_or_insert_with(|| cause.to_string());
                });
            }
        }
        Ok(row)
    }

    fn note(&self, change: impl FnOnce(&mut Tally)) {
        change(&mut self.tally.lock().unwrap_or_else(PoisonError::into_inner));
    }

    fn note_spoilt(&self, path: &Path, why: &str) {
        self.note(|tally| {
            tally.spoilt += 1;
            tally.first_spoilt.get_or_insert_with(|| format!("{} {why}", path.display()));
        });
    }
}

#[cfg(test)]
mod tests;
