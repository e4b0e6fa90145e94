//! A serial port, on this machine or over TCP (RFC 2217), whose rate can be changed.

use std::io;
use std::path::Path;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::rfc2217;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio_serial::{DataBits, FlowControl, Parity, SerialPort, SerialPortBuilderExt, SerialStream, StopBits};

use crate::dial;

/// Bytes taken from the network at a time.
const READ_CHUNK: usize = 2048;

/// The host's end of a serial line.
#[derive(Debug)]
pub(crate) enum Port {
    Local(SerialStream),
    Remote(Remote),
}

/// A port over TCP.
#[derive(Debug)]
pub(crate) struct Remote {
    stream: TcpStream,
    client: rfc2217::Client,
    arrived: Vec<u8>,
    out: Vec<u8>,
}

impl Port {
    /// Opens a port of this machine: 8 data bits, no parity, one stop bit.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let port = tokio_serial::new(path.to_string_lossy(), Rate::default().bits_per_second())
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .open_native_async()?;
        Ok(Self::Local(port))
    }

    /// Connects to a port over TCP.
    pub(crate) async fn connect(address: &str, timeout: Duration) -> io::Result<Self> {
        let stream = dial::tcp(address, timeout).await?;
        let client = rfc2217::Client::new();
        let mut out = Vec::new();
        client.begin(&mut out);
        Ok(Self::Remote(Remote { stream, client, arrived: Vec::new(), out }))
    }

    /// Runs at `rate` from now on. What was written before must have left.
    pub(crate) fn set_rate(&mut self, rate: Rate) -> io::Result<()> {
        match self {
            Self::Local(port) => Ok(port.set_baud_rate(rate.bits_per_second())?),
            Self::Remote(remote) => {
                remote.client.set_rate(rate.bits_per_second(), &mut remote.out);
                Ok(())
            }
        }
    }
}

impl Remote {
    fn poll_out(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        while !self.out.is_empty() {
            let sent = ready!(Pin::new(&mut self.stream).poll_write(cx, &self.out))?;
            self.out.drain(..sent);
        }
        Poll::Ready(Ok(()))
    }

    fn poll_read(&mut self, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        while self.arrived.is_empty() {
            if let Poll::Ready(Err(cause)) = self.poll_out(cx) {
                return Poll::Ready(Err(cause));
            }
            let mut chunk = [0; READ_CHUNK];
            let mut room = ReadBuf::new(&mut chunk);
            ready!(Pin::new(&mut self.stream).poll_read(cx, &mut room))?;
            if room.filled().is_empty() {
                return Poll::Ready(Ok(()));
            }
            self.client.decode(room.filled(), &mut self.arrived, &mut self.out);
            if self.client.is_refused() {
                return Poll::Ready(Err(io::Error::new(
                    io::ErrorKind::Unsupported,
                    "it is no serial port over TCP (it refuses RFC 2217)",
                )));
            }
        }
        let taken = self.arrived.len().min(buf.remaining());
        buf.put_slice(self.arrived.get(..taken).unwrap_or_default());
        self.arrived.drain(..taken);
        Poll::Ready(Ok(()))
    }
}

impl AsyncRead for Port {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        match &mut *self {
            Self::Local(port) => Pin::new(port).poll_read(cx, buf),
            Self::Remote(remote) => remote.poll_read(cx, buf),
        }
    }
}

impl AsyncWrite for Port {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        match &mut *self {
            Self::Local(port) => Pin::new(port).poll_write(cx, bytes),
            Self::Remote(remote) => {
                ready!(remote.poll_out(cx))?;
                rfc2217::escape(bytes, &mut remote.out);
                let _ = remote.poll_out(cx)?;
                Poll::Ready(Ok(bytes.len()))
            }
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut *self {
            Self::Local(port) => Pin::new(port).poll_flush(cx),
            Self::Remote(remote) => remote.poll_out(cx),
        }
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut *self {
            Self::Local(port) => Pin::new(port).poll_shutdown(cx),
            Self::Remote(remote) => Pin::new(&mut remote.stream).poll_shutdown(cx),
        }
    }
}
