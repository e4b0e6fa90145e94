//! A live source as bare bytes, without a session: for who stands between a scanner and somebody else's client.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};

use rowscan_protocol::lms2xx::Rate;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use crate::endpoint::{Place, Port};
use crate::{DriverError, Source};

/// A scanner's bytes, with the socket options and port settings that the driver uses.
#[derive(Debug)]
pub struct ByteStream(Line);

#[derive(Debug)]
enum Line {
    #[cfg(feature = "tcp")]
    Tcp(tokio::net::TcpStream),
    Port(Port),
}

impl ByteStream {
    /// Connects; nothing is sent to the device. How long it may take is the caller's affair.
    ///
    /// # Errors
    /// The source is a recording, its feature is left out, or it cannot be reached.
    pub async fn open(source: &Source) -> Result<Self, DriverError> {
        let port = |cause| DriverError::Port { place: source.to_string(), cause };
        match source {
            #[cfg(feature = "tcp")]
            Source::Tcp { address } => {
                let stream = crate::endpoint::dial::tcp(address).await;
                let stream =
                    stream.map_err(|cause| DriverError::Connect { address: address.clone(), cause })?;
                Ok(Self(Line::Tcp(stream)))
            }
            #[cfg(feature = "serial")]
            Source::Serial { path, rate } => {
                Self::open_port(Place::Local(path.clone()), *rate).await.map_err(port)
            }
            #[cfg(feature = "tcp")]
            Source::Rfc2217 { address, rate } => {
                Self::open_port(Place::Remote(address.clone()), *rate).await.map_err(port)
            }
            source => {
                let why = match source {
                    Source::Picoscan(_) => "its scans are datagrams, which pass no stream of bytes",
                    _ => "it is no live source of this build",
                };
                let cause = io::Error::new(io::ErrorKind::Unsupported, why);
                Err(DriverError::Port { place: source.to_string(), cause })
            }
        }
    }

    async fn open_port(place: Place, rate: Rate) -> io::Result<Self> {
        let mut port = Port::open(&place).await?;
        port.set_rate(rate)?;
        Ok(Self(Line::Port(port)))
    }

    /// Runs a serial line at `rate` from now on; what was written before must have left. TCP has no rate.
    ///
    /// # Errors
    /// The port's.
    pub fn set_rate(&mut self, rate: Rate) -> io::Result<()> {
        match &mut self.0 {
            #[cfg(feature = "tcp")]
            Line::Tcp(_) => Ok(()),
            Line::Port(port) => port.set_rate(rate),
        }
    }
}

impl AsyncRead for ByteStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        match &mut self.0 {
            #[cfg(feature = "tcp")]
            Line::Tcp(stream) => Pin::new(stream).poll_read(cx, buf),
            Line::Port(port) => Pin::new(port).poll_read(cx, buf),
        }
    }
}

impl AsyncWrite for ByteStream {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        match &mut self.0 {
            #[cfg(feature = "tcp")]
            Line::Tcp(stream) => Pin::new(stream).poll_write(cx, bytes),
            Line::Port(port) => Pin::new(port).poll_write(cx, bytes),
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut self.0 {
            #[cfg(feature = "tcp")]
            Line::Tcp(stream) => Pin::new(stream).poll_flush(cx),
            Line::Port(port) => Pin::new(port).poll_flush(cx),
        }
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut self.0 {
            #[cfg(feature = "tcp")]
            Line::Tcp(stream) => Pin::new(stream).poll_shutdown(cx),
            Line::Port(port) => Pin::new(port).poll_shutdown(cx),
        }
    }
}
