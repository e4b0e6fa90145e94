//! What every kind of line has in common, seen from the scanner.

use std::fmt;
use std::io;

use tokio::io::{AsyncRead, AsyncWrite};

use super::Pty;

/// The scanner's end of a serial line.
pub trait Wire: AsyncRead + AsyncWrite + Unpin + Send + fmt::Debug {
    /// The rate the client's end is set to, bits a second; none where it cannot be told.
    fn client_rate(&self) -> io::Result<Option<u32>>;

    /// The scanner sends and hears at `rate` from now on.
    fn set_rate(&mut self, rate: u32) -> io::Result<()>;

    /// Whether there is anyone to hear, as far as reads and writes have noticed; a line that cannot tell says yes.
    fn is_open(&self) -> bool;

    /// True if bytes take their time on it by themselves.
    fn paces_itself(&self) -> bool {
        false
    }
}

impl Wire for Box<dyn Wire> {
    fn client_rate(&self) -> io::Result<Option<u32>> {
        (**self).client_rate()
    }

    fn set_rate(&mut self, rate: u32) -> io::Result<()> {
        (**self).set_rate(rate)
    }

    fn is_open(&self) -> bool {
        (**self).is_open()
    }

    fn paces_itself(&self) -> bool {
        (**self).paces_itself()
    }
}

impl Wire for Pty {
    fn client_rate(&self) -> io::Result<Option<u32>> {
        Pty::client_rate(self).map(Some)
    }

    fn set_rate(&mut self, _: u32) -> io::Result<()> {
        Ok(())
    }

    fn is_open(&self) -> bool {
        Pty::is_open(self)
    }
}

/// One end of a pair in a test: always open, and at the scanner's rate.
impl Wire for tokio::io::DuplexStream {
    fn client_rate(&self) -> io::Result<Option<u32>> {
        Ok(None)
    }

    fn set_rate(&mut self, _: u32) -> io::Result<()> {
        Ok(())
    }

    fn is_open(&self) -> bool {
        true
    }
}
