//! What clients have not read, where the kernel does not tell.

use std::io;
use std::net::SocketAddr;

use super::Unread;

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
