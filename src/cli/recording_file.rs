//! Recordings that a command reads.

use std::path::Path;

use rowscan_recording::Recording;

use super::Failure;

/// Opens a recording.
pub(super) fn open(file: &Path) -> Result<Recording, Failure> {
    Recording::open(file).map_err(|cause| unreadable(file, cause))
}

/// The message of a recording that cannot be read.
pub(super) fn unreadable(file: &Path, cause: rowscan_recording::ReadError) -> Failure {
    rowscan_driver::DriverError::Recording { path: file.to_owned(), cause }.into()
}
