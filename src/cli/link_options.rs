//! What every command that follows a scanner has in common.

use std::time::Duration;

use rowscan_driver::Source;
use rowscan_protocol::frame::Dialect;
use rowscan_recording::StreamKind;

/// How long the device is given to end the stream.
pub(super) const STOP_TIMEOUT: Duration = Duration::from_secs(2);

/// The dialect a driver tries first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Prefer {
    /// CoLa A, ASCII
    A,
    /// CoLa B, binary
    #[default]
    B,
}

impl From<Prefer> for Dialect {
    fn from(prefer: Prefer) -> Self {
        match prefer {
            Prefer::A => Self::A,
            Prefer::B => Self::B,
        }
    }
}

/// What a source's bytes are.
pub(super) fn stream_kind(source: &Source) -> StreamKind {
    match source {
        Source::Serial { .. } | Source::Rfc2217 { .. } => StreamKind::Lms2xx,
        Source::Picoscan(_) => StreamKind::Compact,
        _ => StreamKind::Cola,
    }
}
