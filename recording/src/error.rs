//! What can go wrong with a recording that is being written.

use std::io;
use std::path::PathBuf;

/// Why a recording could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The file cannot be made.
    #[error("cannot record to {}: {cause}; expected a file that can be written, in a folder that exists", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// There is something already, which nobody wants to lose.
    #[error("cannot record to {}: it holds {bytes} bytes already; choose another name, or move it away", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
        /// Its length.
        bytes: u64,
    },
    /// Writing failed on the way, as on a full disk.
    #[error("cannot write on to {}: {cause}; {packets} packets are kept up to here", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
        /// Packets handed to the file before.
        packets: u64,
    },
}
