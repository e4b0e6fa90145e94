//! Where mEEwriteall keeps the settings of a virtual scanner: a file that is replaced whole or not at all.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rowscan_files::{NameLock, OutputFile, read_own};
use rowscan_protocol::device::SavedSettingsError;
use rowscan_protocol::lms2xx;

/// No settings are longer.
const MAX_BYTES: u64 = 64 * 1024;

/// A file of saved settings, of one scanner at a time.
#[derive(Clone, Debug)]
pub struct StateFile {
    path: PathBuf,
    _lock: Arc<NameLock>,
}

/// Why a file of settings cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StateFileError {
    /// Another scanner keeps its settings there.
    #[error("the settings in {} are another running scanner's; name another file, or end that program", .0.display())]
    InUse(PathBuf),
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
        let lock = match NameLock::take(&path) {
            Ok(lock) => Arc::new(lock),
            Err(cause) if cause.kind() == io::ErrorKind::AddrInUse => {
                return Err(StateFileError::InUse(path));
            }
            Err(cause) => return Err(StateFileError::Read { path, cause }),
        };
        match read(&path) {
            Ok(text) => match restore(&text) {
                Ok(()) => Ok(Self { path, _lock: lock }),
                Err(cause) => Err(StateFileError::Settings { path, cause: cause.into() }),
            },
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(Self { path, _lock: lock }),
            Err(cause)
                if matches!(cause.kind(), io::ErrorKind::InvalidData | io::ErrorKind::FileTooLarge) =>
            {
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
    String::from_utf8(read_own(path, MAX_BYTES)?).map_err(|_| io::ErrorKind::InvalidData.into())
}

/// Whoever reads sees the old settings or the new ones.
fn replace(path: &Path, settings: &str) -> io::Result<()> {
    OutputFile::create_anew(path)?.write_whole(settings.as_bytes())
}
