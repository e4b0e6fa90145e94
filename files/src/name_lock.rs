//! A lock on a name in a folder, gone when its owner is, however that ends.

use std::io;
use std::path::Path;

/// Held by one program of the machine at a time. On Linux it is a socket in the abstract namespace, which the system removes when its
/// owner dies: no file is left behind. Elsewhere it locks nothing.
#[derive(Debug)]
pub struct NameLock {
    #[cfg(target_os = "linux")]
    _socket: std::os::unix::net::UnixDatagram,
}

impl NameLock {
    /// Takes the lock of `path`, whatever stands there.
    ///
    /// # Errors
    /// [`io::ErrorKind::AddrInUse`] if another has it; the system's if its folder cannot be read.
    #[cfg(target_os = "linux")]
    pub fn take(path: &Path) -> io::Result<Self> {
        use std::os::linux::net::SocketAddrExt as _;
        use std::os::unix::ffi::OsStrExt as _;
        use std::os::unix::fs::MetadataExt as _;
        use std::os::unix::net::{SocketAddr, UnixDatagram};

        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // One folder may have several names; its number is one.
        let folder = std::fs::metadata(folder)?;
        // FNV-1a: a socket's name holds 107 bytes, a file's 255.
        let name = path.file_name().unwrap_or_default().as_bytes();
        let hash = name.iter().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3)
        });
        let name = format!("rowscan-link-{:x}-{:x}-{hash:x}", folder.dev(), folder.ino());
        Ok(Self { _socket: UnixDatagram::bind_addr(&SocketAddr::from_abstract_name(name)?)? })
    }

    #[cfg(not(target_os = "linux"))]
    /// Locks nothing here.
    ///
    /// # Errors
    /// None.
    pub fn take(_: &Path) -> io::Result<Self> {
        Ok(Self {})
    }
}
