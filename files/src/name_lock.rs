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
        use std::time::{Duration, SystemTime};

        /// A lock that was given up lives on for a moment where a child has it that has not begun its program.
        const TRIES: u32 = 20;
        const PAUSE: Duration = Duration::from_millis(5);

        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // One folder may have several names; its number is one, and the next folder's after it: when it was made tells them apart.
        let folder = std::fs::metadata(folder)?;
        let made = folder.created().ok().and_then(|at| at.duration_since(SystemTime::UNIX_EPOCH).ok());
        let made_ns = made.map_or(0, |since| since.as_nanos());
        // FNV-1a: a socket's name holds 107 bytes, a file's 255.
        let name = path.file_name().unwrap_or_default().as_bytes();
        let hash = name.iter().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3)
        });
        let name = format!("rowscan-link-{:x}-{:x}-{made_ns:x}-{hash:x}", folder.dev(), folder.ino());
        let address = SocketAddr::from_abstract_name(name)?;
        for _ in 0..TRIES {
            match UnixDatagram::bind_addr(&address) {
                Err(cause) if cause.kind() == io::ErrorKind::AddrInUse => std::thread::sleep(PAUSE),
                bound => return Ok(Self { _socket: bound? }),
            }
        }
        Err(io::ErrorKind::AddrInUse.into())
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

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_lock_is_one_owners_and_free_soon_after_it_ends() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scanner");
        let first = NameLock::take(&path).unwrap();
        assert_eq!(NameLock::take(&path).unwrap_err().kind(), io::ErrorKind::AddrInUse);
        assert!(NameLock::take(&folder.path().join("another")).is_ok());
        // As where a child has it that begins its program a moment later.
        let kept = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(20));
            drop(first);
        });
        assert!(NameLock::take(&path).is_ok());
        kept.join().unwrap();
    }
}
