//! Where mEEwriteall keeps the settings of a virtual scanner: a file that is replaced whole or not at all.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rowscan_protocol::device::SavedSettingsError;
use rowscan_protocol::lms2xx;
use rowscan_recording::OutputFile;

/// No settings are longer.
const MAX_BYTES: u64 = 64 * 1024;

/// A file of saved settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StateFile {
    path: PathBuf,
}

/// Why a file of settings cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StateFileError {
    /// It cannot be read.
    #[error("cannot read the settings in {}: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// It holds something else. It is left as it is.
    #[error("{} is not used and stays as it is: {cause}; name another file, or remove this one", path.display())]
    Settings {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        cause: SettingsError,
    },
}

/// Why a text is no settings of this device.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// Not of a CoLa device.
    #[error(transparent)]
    Cola(#[from] SavedSettingsError),
    /// Not of an LMS2xx.
    #[error(transparent)]
    Lms2xx(#[from] lms2xx::device::SavedBlockError),
}

impl StateFile {
    /// The file at `path`, which need not exist yet. If it does, `restore` takes its settings over.
    pub fn open<E: Into<SettingsError>>(
        path: &Path,
        restore: impl FnOnce(&str) -> Result<(), E>,
    ) -> Result<Self, StateFileError> {
        let path = path.to_owned();
        match read(&path) {
            Ok(text) => match restore(&text) {
                Ok(()) => Ok(Self { path }),
                Err(cause) => Err(StateFileError::Settings { path, cause: cause.into() }),
            },
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(Self { path }),
            Err(cause) if cause.kind() == io::ErrorKind::InvalidData => {
                Err(StateFileError::Settings { path, cause: SavedSettingsError::Foreign.into() })
            }
            Err(cause) => Err(StateFileError::Read { path, cause }),
        }
    }

    /// Replaces the file.
    pub(crate) async fn keep(&self, settings: String) -> io::Result<()> {
        let path = self.path.clone();
        tokio::task::spawn_blocking(move || replace(&path, &settings)).await?.inspect_err(|cause| {
            tracing::error!(path = %self.path.display(), %cause, "settings not saved");
        })
    }
}

/// A file that is too large is as foreign as one that is no text.
fn read(path: &Path) -> io::Result<String> {
    if fs::metadata(path)?.len() > MAX_BYTES {
        return Err(io::ErrorKind::InvalidData.into());
    }
    fs::read_to_string(path)
}

/// Whoever reads sees the old settings or the new ones.
fn replace(path: &Path, settings: &str) -> io::Result<()> {
    let mut out = OutputFile::create(path)?;
    out.write_all(settings.as_bytes())?;
    out.commit()
}
