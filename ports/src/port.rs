//! A real serial port: a cable to a firmware board, or to another computer.

use std::io;
use std::path::Path;
use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio_serial::{DataBits, FlowControl, Parity, SerialPort, SerialPortBuilderExt, SerialStream, StopBits};

use crate::{PortError, Wire};

/// A serial port with 8 data bits, no parity and one stop bit.
#[derive(Debug)]
pub struct Port(SerialStream);

impl Port {
    /// Opens the port at `path`, at `rate` bits a second.
    pub fn open(path: &Path, rate: u32) -> Result<Self, PortError> {
        tokio_serial::new(path.to_string_lossy(), rate)
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .open_native_async()
            .map(Self)
            .map_err(|cause| PortError::Port { path: path.to_owned(), cause: cause.into() })
    }
}

impl Wire for Port {
    fn client_rate(&self) -> io::Result<Option<u32>> {
        Ok(None)
    }

    fn set_rate(&mut self, rate: u32) -> io::Result<()> {
        Ok(self.0.set_baud_rate(rate)?)
    }

    fn is_open(&self) -> bool {
        true
    }

    fn paces_itself(&self) -> bool {
        true
    }
}

impl AsyncRead for Port {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_read(cx, buf)
    }
}

impl AsyncWrite for Port {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.0).poll_write(cx, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_shutdown(cx)
    }
}
