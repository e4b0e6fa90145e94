//! What a client tells its caller.

use alloc::string::String;

use crate::frame::Dialect;
use crate::telegram::NoDistance;
use crate::telegram::SopasError;
use crate::telegram::wire::WireError;

/// What happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The device is set up and will send scans.
    Ready(DeviceInfo),
    /// A scan came: [`Client::scan`](super::Client::scan).
    Scan,
    /// The device refused a command.
    Refused {
        /// The command's name.
        command: &'static str,
        /// The device's reason.
        error: SopasError,
        /// The start-up cannot go on without it: the client is done.
        fatal: bool,
    },
    /// No answer in time: the wrong dialect, or nobody there. The client is done; try the other dialect over a new connection,
    /// because some devices stay silent for the rest of one that began in the wrong dialect.
    NoAnswer {
        /// The command's name.
        command: &'static str,
        /// The dialect tried.
        dialect: Dialect,
    },
    /// A scan telegram in a good frame that makes no sense.
    Malformed {
        /// Why, in words.
        reason: String,
    },
    /// The clean stop is done.
    Stopped,
}

/// What a device says of itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceInfo {
    /// DeviceIdent: name and version.
    pub ident: String,
    /// FirmwareVersion, without the blanks devices pad it with.
    pub firmware: String,
}

/// Why a scan telegram gives no scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum ScanError {
    /// Its fields cannot be read.
    #[error("scan telegram: {0}")]
    Wire(#[from] WireError),
    /// It has no ranges.
    #[error(transparent)]
    NoDistance(#[from] NoDistance),
}
