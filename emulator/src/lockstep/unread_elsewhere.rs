//! What clients have not read, where the kernel does not tell.

use std::io;
use std::net::SocketAddr;

/// A TCP connection of this program with another one on this machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unread {
    /// This program's end.
    pub here: SocketAddr,
    /// Bytes that this program has written since the connection was opened.
    pub written: u64,
    /// Bytes of these that the other program has not read.
    pub unread: u64,
}

/// Nothing is known.
///
/// # Errors
/// Always.
pub fn unread() -> io::Result<Vec<Unread>> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Nothing is known.
///
/// # Errors
/// Always.
pub fn unread_datagrams(_: SocketAddr) -> io::Result<u64> {
    Err(io::ErrorKind::Unsupported.into())
}
