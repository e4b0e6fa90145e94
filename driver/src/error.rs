//! What can go wrong between a host and its scanner.

use std::io;
#[cfg(feature = "recordings")]
use std::path::PathBuf;
use std::time::Duration;

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::telegram::SopasError;
#[cfg(feature = "recordings")]
use rowscan_recording::{Format, ReadError, Torn};

/// Why a source could not be opened or read on. Each message names the remedy where there is one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DriverError {
    /// The source is written in a way the driver does not know.
    #[error(
        "source `{found}` is not understood: {reason}; expected tcp://HOST:PORT, serial:/dev/ttyUSB0?baud=38400, rfc2217://HOST:PORT or the path of a recording"
    )]
    Source {
        /// What was given.
        found: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The source needs a feature that this build leaves out.
    #[error("`{source_text}` needs the feature `{feature}` of rowscan-driver, and this build leaves it out")]
    Feature {
        /// The source.
        source_text: String,
        /// The feature's name.
        feature: &'static str,
    },
    /// No TCP connection could be made.
    #[error(
        "cannot connect to {address}: {cause}; is the scanner powered, and is this its address and port (2111 or 2112)?"
    )]
    Connect {
        /// Host and port.
        address: String,
        /// What the system said.
        cause: io::Error,
    },
    /// A serial port could not be opened.
    #[error(
        "cannot open {place}: {cause}; is the port there, may you use it (group `dialout`), and does no other program have it open?"
    )]
    Port {
        /// The source.
        place: String,
        /// What the system said.
        cause: io::Error,
    },
    /// No LMS2xx answers on a serial line.
    #[error(
        "no LMS2xx answers on {place} at 9600, 38400, 19200 or 500000 bits a second ({what}){junk}; is it powered, and are its lines crossed?"
    )]
    NoLms2xx {
        /// The source.
        place: String,
        /// What it was asked to do.
        what: &'static str,
        /// What came instead, if anything.
        junk: JunkBytes,
    },
    /// An LMS2xx refused what no scan can come without.
    #[error("the LMS2xx on {place} refused: {what}")]
    Declined {
        /// The source.
        place: String,
        /// What it was asked to do.
        what: &'static str,
    },
    /// An LMS2xx has restarted.
    #[error("the LMS2xx on {place} has restarted")]
    Restarted {
        /// The source.
        place: String,
    },
    /// The peer accepted the connection and answered in neither dialect.
    #[error(
        "{address} accepts connections but does not answer as a SICK scanner: no reply to `sRN DeviceIdent` within {timeout:?} in \
         CoLa B nor in CoLa A{junk}; is another program listening on this port?"
    )]
    NoDialect {
        /// Host and port.
        address: String,
        /// How long each dialect was given.
        timeout: Duration,
        /// What came instead, if anything.
        junk: JunkBytes,
    },
    /// A command of the start-up got no reply.
    #[error("{address} did not answer `{command}` in {dialect} within {timeout:?}")]
    NoAnswer {
        /// Host and port.
        address: String,
        /// The command.
        command: &'static str,
        /// The dialect in use.
        dialect: Dialect,
        /// How long it was given.
        timeout: Duration,
    },
    /// A command without which no scan can come was refused.
    #[error("{address} refused `{command}`: {code}")]
    Refused {
        /// Host and port.
        address: String,
        /// The command.
        command: &'static str,
        /// The device's reason.
        code: SopasError,
    },
    /// The peer closed the connection.
    #[error("{address} closed the connection {when}")]
    Closed {
        /// Host and port.
        address: String,
        /// In which phase.
        when: &'static str,
    },
    /// The link broke.
    #[error("the link to {address} broke: {cause}")]
    Link {
        /// Host and port.
        address: String,
        /// What the system said.
        cause: io::Error,
    },
    /// Nothing arrived for too long.
    #[error("{address} sent nothing for {timeout:?}")]
    Stalled {
        /// Host and port.
        address: String,
        /// The limit.
        timeout: Duration,
    },
    /// A lost link stayed lost.
    #[error("gave up on {address} after {after:?} without a connection; the last attempt said: {last}")]
    GaveUp {
        /// Host and port.
        address: String,
        /// How long it was tried.
        after: Duration,
        /// The last attempt's error.
        last: Box<DriverError>,
    },
    /// A recording could not be read.
    #[cfg(feature = "recordings")]
    #[error("cannot read recording {}: {cause}", path.display())]
    Recording {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        cause: ReadError,
    },
    /// A recording has no stream of that name.
    #[cfg(feature = "recordings")]
    #[error("{} has no stream `{wanted}`; it has {}", path.display(), found.join(", "))]
    NoStream {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        wanted: String,
        /// What there is.
        found: Vec<String>,
    },
    /// A file holds telegrams, and none of them is a scan.
    #[cfg(feature = "recordings")]
    #[error("{} ({format}) holds no scan; it holds {holds}{}", path.display(), torn.as_ref().map_or_else(String::new, |torn| format!("; {torn}")))]
    NoScan {
        /// The file.
        path: PathBuf,
        /// What the file looks like.
        format: Format,
        /// Its telegrams by name and count.
        holds: String,
        /// Where it breaks off, if it does.
        torn: Option<Torn>,
    },
    /// A file holds no telegram.
    #[cfg(feature = "recordings")]
    #[error(
        "{} ({format}) holds no SICK telegram in its {bytes} bytes; expected CoLa A (02 … 03) or CoLa B (02 02 02 02, length, payload, checksum) frames \
         with LMDscandata",
        path.display()
    )]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// What the file looks like.
        format: Format,
        /// Bytes in which a telegram could have been.
        bytes: u64,
    },
}

/// Bytes of a peer that speaks no known protocol: so many belong to no valid frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JunkBytes(pub u64);

impl std::fmt::Display for JunkBytes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            0 => Ok(()),
            n => write!(f, " ({n} bytes came that are no telegram)"),
        }
    }
}
