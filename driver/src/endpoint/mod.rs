//! What a link connects to.

#[cfg(feature = "tcp")]
mod cola;
#[cfg(feature = "tcp")]
pub(crate) mod dial;
mod lms2xx;
mod port;

use std::io;
use std::pin::Pin;

#[cfg(feature = "tcp")]
pub(crate) use cola::ColaEndpoint;
pub(crate) use lms2xx::Lms2xxEndpoint;
pub(crate) use port::{Place, Port};
use rowscan_protocol::frame::FrameCounts;
use rowscan_protocol::host::{DeviceInfo, HostSession, Refusal};
use rowscan_protocol::lms2xx::Rate;
use rowscan_recording::Tap;
use tokio::io::{AsyncRead, AsyncWrite};

use crate::error::DriverError;

/// A connection being opened. It owns all it needs, so that a link can keep it.
pub(crate) type Opening<T> = Pin<Box<dyn Future<Output = io::Result<T>> + Send>>;

/// How a scanner is reached, and what its failures mean.
pub(crate) trait Endpoint: Send {
    type Stream: AsyncRead + AsyncWrite + Unpin + Send;
    type Session: HostSession + Send;

    /// As the user named it.
    fn address(&self) -> &str;

    /// Begins to open a stream.
    fn open(&self) -> Opening<Self::Stream>;

    /// Changes the rate of a serial line.
    fn set_rate(stream: &mut Self::Stream, rate: Rate) -> io::Result<()>;

    /// A session for a stream that was just opened.
    fn session(&self) -> Self::Session;

    /// What gets a copy of the bytes of a stream.
    fn tap(&self, tap: &Tap) -> Tap {
        tap.clone()
    }

    /// The device streams: what it answered to is tried first from now on.
    fn ready(&mut self, info: &DeviceInfo);

    /// The device did not answer `command`. `Ok` if it shall be tried another way at once, over a new connection.
    fn no_answer(&mut self, command: &'static str, counts: FrameCounts) -> Result<(), DriverError>;

    /// The peer closed the connection during start-up, when so much had come.
    fn closed_early(&self, _: FrameCounts) -> DriverError {
        DriverError::Closed { address: self.address().to_owned(), when: "during start-up" }
    }

    /// An attempt has failed: the next one begins anew.
    fn failed(&mut self);

    /// No stream could be opened.
    fn cannot_open(&self, cause: io::Error) -> DriverError;

    /// The device refused what no scan can come without.
    fn refused(&self, command: &'static str, error: Option<Refusal>) -> DriverError;
}
