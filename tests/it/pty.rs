//! The pseudo-terminal: clients come, go, are killed and come again, and the scanner's end does not notice.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails by panicking")]

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::Duration;

use rowscan_ports::{PortError, Pty};
use rustix::fs::OFlags;
use rustix::termios::{OptionalActions, ioctl_tiocexcl, tcgetattr, tcsetattr};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::timeout;

/// Opens the client's end, raw, without waiting for bytes.
fn client(path: &Path, rate: u32) -> File {
    let flags = OFlags::NOCTTY | OFlags::NONBLOCK;
    let port =
        OpenOptions::new().read(true).write(true).custom_flags(flags.bits() as i32).open(path).unwrap();
    let mut settings = tcgetattr(&port).unwrap();
    settings.make_raw();
    settings.set_speed(rate).unwrap();
    tcsetattr(&port, OptionalActions::Now, &settings).unwrap();
    port
}

/// What the client's end holds now.
fn held(mut port: &File) -> Vec<u8> {
    let mut bytes = vec![0; 8192];
    let read = port.read(&mut bytes).unwrap_or(0);
    bytes.truncate(read);
    bytes
}

async fn read(pty: &mut Pty) -> Vec<u8> {
    let mut bytes = vec![0; 64];
    let read = timeout(Duration::from_secs(5), pty.read(&mut bytes)).await.expect("bytes came").unwrap();
    bytes.truncate(read);
    bytes
}

#[tokio::test]
async fn bytes_pass_and_the_client_s_rate_shows() {
    let folder = tempfile::tempdir().unwrap();
    let mut pty = Pty::open(&folder.path().join("scanner")).unwrap();
    assert_eq!(pty.client_rate().unwrap(), 9600);
    // 38401 is no classic rate: such ones are set another way.
    for rate in [9600, 19_200, 38_400, 500_000, 38_401] {
        let mut port = client(pty.path(), rate);
        port.write_all(b"ask\n\x03").unwrap();
        assert_eq!(read(&mut pty).await, b"ask\n\x03");
        assert_eq!(pty.client_rate().unwrap(), rate);
        pty.write_all(b"answer\r\x04").await.unwrap();
        assert_eq!(held(&port), b"answer\r\x04");
    }
}

#[tokio::test]
async fn nobody_there_is_silence_and_not_an_end() {
    let folder = tempfile::tempdir().unwrap();
    let mut pty = Pty::open(&folder.path().join("scanner")).unwrap();
    for _ in 0..3 {
        let port = client(pty.path(), 9600);
        timeout(Duration::from_secs(5), pty.opened()).await.expect("opened").unwrap();
        drop(port);
        let quiet = timeout(Duration::from_millis(20), pty.read(&mut [0; 8])).await;
        assert!(quiet.is_err(), "a read waits: {quiet:?}");
        assert!(!pty.is_open());
        // More than the system would keep for a client that does not read.
        pty.write_all(&[0x55; 100_000]).await.unwrap();
        let port = client(pty.path(), 9600);
        timeout(Duration::from_secs(5), pty.opened()).await.expect("opened again").unwrap();
        assert_eq!(held(&port), b"", "nothing was kept for the newcomer");
        pty.write_all(b"fresh").await.unwrap();
        assert_eq!(held(&port), b"fresh");
        // Not read by this one, so not there for the next one either.
        pty.write_all(b"stale").await.unwrap();
    }
}

#[tokio::test]
async fn what_a_client_sent_before_it_left_arrives() {
    let folder = tempfile::tempdir().unwrap();
    let mut pty = Pty::open(&folder.path().join("scanner")).unwrap();
    client(pty.path(), 9600).write_all(b"stop").unwrap();
    assert_eq!(read(&mut pty).await, b"stop");
}

#[tokio::test]
async fn a_client_that_never_reads_leaves_no_full_line_behind() {
    let folder = tempfile::tempdir().unwrap();
    let mut pty = Pty::open(&folder.path().join("scanner")).unwrap();
    let port = client(pty.path(), 9600);
    let full = timeout(Duration::from_millis(50), pty.write_all(&[0x55; 100_000])).await;
    assert!(full.is_err(), "the line is full: {full:?}");
    let (written, ()) =
        tokio::join!(timeout(Duration::from_secs(5), pty.write_all(&[0x55; 100_000])), async {
            tokio::task::yield_now().await;
            drop(port);
        });
    written.expect("nobody there takes everything").unwrap();
}

#[tokio::test]
async fn exclusive_use_ends_with_its_client() {
    let folder = tempfile::tempdir().unwrap();
    let mut pty = Pty::open(&folder.path().join("scanner")).unwrap();
    let port = client(pty.path(), 9600);
    ioctl_tiocexcl(&port).unwrap();
    timeout(Duration::from_secs(5), pty.opened()).await.expect("opened").unwrap();
    drop(port);
    assert!(timeout(Duration::from_millis(20), pty.read(&mut [0; 8])).await.is_err());
    // Root could open it anyway; `tools/python` has the same as an ordinary user.
    let mut port = client(pty.path(), 9600);
    port.write_all(b"again").unwrap();
    assert_eq!(read(&mut pty).await, b"again");
}

#[tokio::test]
async fn the_link_goes_with_the_line_and_names_in_use_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scanner");
    let pty = Pty::open(&path).unwrap();
    assert!(std::fs::read_link(&path).unwrap().starts_with("/dev/pts"));
    drop(pty);
    assert!(std::fs::symlink_metadata(&path).is_err());
    std::fs::write(&path, "mine").unwrap();
    let refused = Pty::open(&path).expect_err("a file is there");
    assert!(matches!(refused, PortError::Link(_)), "{refused}");
    assert!(refused.to_string().contains("choose another name"), "{refused}");
    let refused = Pty::open(&folder.path().join("no/such/folder")).expect_err("no folder");
    assert!(refused.to_string().contains("expected a name in a folder"), "{refused}");
}
