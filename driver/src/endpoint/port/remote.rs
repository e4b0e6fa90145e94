//! Serial ports behind an RFC 2217 server.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::rfc2217;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;

use crate::endpoint::dial;

/// Bytes taken from the network at a time.
const READ_CHUNK: usize = 2048;

/// A port over TCP.
#[derive(Debug)]
pub(crate) struct Remote {
    stream: TcpStream,
    client: rfc2217::Client,
    arrived: Vec<u8>,
    out: Vec<u8>,
}

impl Remote {
    pub(super) async fn connect(address: &str) -> io::Result<Self> {
        let stream = dial::tcp(address).await?;
        let client = rfc2217::Client::new();
        let mut out = Vec::new();
        client.begin(&mut out);
        Ok(Self { stream, client, arrived: Vec::new(), out })
    }

    pub(super) fn set_rate(&mut self, rate: Rate) {
        self.client.set_rate(rate.bits_per_second(), &mut self.out);
    }

    fn poll_out(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        while !self.out.is_empty() {
            let sent = ready!(Pin::new(&mut self.stream).poll_write(cx, &self.out))?;
            self.out.drain(..sent);
        }
        Poll::Ready(Ok(()))
    }
}

impl AsyncRead for Remote {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let remote = &mut *self;
        while remote.arrived.is_empty() {
            if let Poll::Ready(Err(cause)) = remote.poll_out(cx) {
                return Poll::Ready(Err(cause));
            }
            let mut chunk = [0; READ_CHUNK];
            let mut room = ReadBuf::new(&mut chunk);
            ready!(Pin::new(&mut remote.stream).poll_read(cx, &mut room))?;
            if room.filled().is_empty() {
                return Poll::Ready(Ok(()));
            }
            remote.client.decode(room.filled(), &mut remote.arrived, &mut remote.out);
            if remote.client.is_refused() {
                return Poll::Ready(Err(io::Error::new(
                    io::ErrorKind::Unsupported,
                    "it is no serial port over TCP (it refuses RFC 2217)",
                )));
            }
        }
        let taken = remote.arrived.len().min(buf.remaining());
        buf.put_slice(remote.arrived.get(..taken).unwrap_or_default());
        remote.arrived.drain(..taken);
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for Remote {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        ready!(self.poll_out(cx))?;
        rfc2217::escape(bytes, &mut self.out);
        let _ = self.poll_out(cx)?;
        Poll::Ready(Ok(bytes.len()))
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.poll_out(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}
