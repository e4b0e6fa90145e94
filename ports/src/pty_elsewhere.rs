//! Systems whose pseudo-terminals do not tell who has them open: there is none here.

use std::io;
use std::path::Path;
use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use crate::PortError;

/// A pseudo-terminal; never made on this system.
#[derive(Debug)]
pub struct Pty(std::convert::Infallible);

impl Pty {
    /// Refuses, and names what works instead.
    pub fn open(_link: &Path) -> Result<Self, PortError> {
        Err(PortError::Pty(io::Error::new(io::ErrorKind::Unsupported, "they are emulated on Linux only")))
    }

    /// The name clients open.
    pub fn path(&self) -> &Path {
        match self.0 {}
    }

    /// A watch on what the client has not read yet.
    pub fn untaken(&self) -> Result<Untaken, PortError> {
        match self.0 {}
    }

    /// Whether a client has it open.
    pub fn is_open(&self) -> bool {
        match self.0 {}
    }

    /// The rate the client has set, bits a second.
    pub fn client_rate(&self) -> io::Result<u32> {
        match self.0 {}
    }

    /// Waits until a client has it open.
    pub async fn opened(&mut self) -> io::Result<()> {
        match self.0 {}
    }

    /// Ready once a client has it open.
    pub fn poll_open(&mut self, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        match self.0 {}
    }
}

/// What a pseudo-terminal's client has not read yet; never made on this system.
#[derive(Debug)]
pub struct Untaken(std::convert::Infallible);

impl Untaken {
    /// Waits until all that was written has been read.
    pub async fn taken(&self) {
        match self.0 {}
    }
}

impl AsyncRead for Pty {
    fn poll_read(self: Pin<&mut Self>, _: &mut Context<'_>, _: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        match self.0 {}
    }
}

impl AsyncWrite for Pty {
    fn poll_write(self: Pin<&mut Self>, _: &mut Context<'_>, _: &[u8]) -> Poll<io::Result<usize>> {
        match self.0 {}
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        match self.0 {}
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        match self.0 {}
    }
}
