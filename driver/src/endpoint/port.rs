//! A serial port, on this machine or over TCP (RFC 2217), whose rate can be changed.

#[cfg(feature = "serial")]
mod local;
#[cfg(feature = "tcp")]
mod remote;

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};

use rowscan_protocol::lms2xx::Rate;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

#[cfg(feature = "serial")]
use local::SerialStream;
#[cfg(feature = "tcp")]
use remote::Remote;

/// Where a serial port is.
#[derive(Clone, Debug)]
pub(crate) enum Place {
    /// On this machine: its device file.
    #[cfg(feature = "serial")]
    Local(std::path::PathBuf),
    /// Behind an RFC 2217 server: host and port.
    #[cfg(feature = "tcp")]
    Remote(String),
}

/// The host's end of a serial line.
#[derive(Debug)]
pub(crate) enum Port {
    #[cfg(feature = "serial")]
    Local(SerialStream),
    #[cfg(feature = "tcp")]
    Remote(Remote),
}

impl Port {
    pub(crate) async fn open(place: &Place) -> io::Result<Self> {
        match place {
            #[cfg(feature = "serial")]
            Place::Local(path) => local::open(path).map(Self::Local),
            #[cfg(feature = "tcp")]
            Place::Remote(address) => Remote::connect(address).await.map(Self::Remote),
        }
    }

    /// Runs at `rate` from now on. What was written before must have left.
    pub(crate) fn set_rate(&mut self, rate: Rate) -> io::Result<()> {
        match self {
            #[cfg(feature = "serial")]
            Self::Local(port) => local::set_rate(port, rate),
            #[cfg(feature = "tcp")]
            Self::Remote(remote) => {
                remote.set_rate(rate);
                Ok(())
            }
        }
    }
}

impl AsyncRead for Port {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        match &mut *self {
            #[cfg(feature = "serial")]
            Self::Local(port) => Pin::new(port).poll_read(cx, buf),
            #[cfg(feature = "tcp")]
            Self::Remote(remote) => Pin::new(remote).poll_read(cx, buf),
        }
    }
}

impl AsyncWrite for Port {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        match &mut *self {
            #[cfg(feature = "serial")]
            Self::Local(port) => Pin::new(port).poll_write(cx, bytes),
            #[cfg(feature = "tcp")]
            Self::Remote(remote) => Pin::new(remote).poll_write(cx, bytes),
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut *self {
            #[cfg(feature = "serial")]
            Self::Local(port) => Pin::new(port).poll_flush(cx),
            #[cfg(feature = "tcp")]
            Self::Remote(remote) => Pin::new(remote).poll_flush(cx),
        }
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut *self {
            #[cfg(feature = "serial")]
            Self::Local(port) => Pin::new(port).poll_shutdown(cx),
            #[cfg(feature = "tcp")]
            Self::Remote(remote) => Pin::new(remote).poll_shutdown(cx),
        }
    }
}
