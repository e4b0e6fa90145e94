//! What clients have not read: bytes that wait in the kernel, on either side, for the program at a connection's other end.

use std::io;
use std::net::SocketAddr;

use netlink_packet_sock_diag::constants::IPPROTO_TCP;

use super::bystanders::Bystanders;
use super::sockets::{Sockets, ends};

/// What another program of this machine has not read of what this one sends it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unread {
    /// This program's end.
    pub here: SocketAddr,
    /// Where it sends.
    pub peer: SocketAddr,
    /// Bytes that this program has written since the connection was opened; `None` of datagrams.
    pub written: Option<u64>,
    /// Bytes that the other program has not read; of datagrams the memory that they take, what did not fit is dropped.
    pub unread: u64,
}

/// What other programs of this machine have not read of this program's TCP connections and datagrams.
///
/// # Errors
/// Where the kernel does not tell (sock_diag).
pub fn unread() -> io::Result<Vec<Unread>> {
    let mut sockets = Sockets::open(Bystanders::default())?;
    sockets.connections()?;
    let mut found = Vec::new();
    for known in sockets.known.clone() {
        let Some(far) = known.far else { continue };
        let (far, near) = (sockets.ask(&far)?, sockets.ask(&known.here)?);
        let (Some(far), Some(near)) = (far, near) else { continue };
        if sockets.own.contains(&far.inode) {
            continue;
        }
        let counts = match known.here.protocol {
            IPPROTO_TCP => sockets.counts(&known.here)?,
            _ => None,
        };
        let pending = counts.map_or(0, |counts| counts.pending);
        found.push(Unread {
            here: ends(&near).0,
            peer: known.peer,
            written: counts.map(|counts| counts.written),
            unread: u64::from(far.recv_queue) + u64::from(pending),
        });
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Write as _};
    use std::net::TcpListener;
    use std::process::{Command, Stdio};

    use super::*;

    /// A program that connects to this port and copies so many bytes from there, then waits to be ended.
    fn reader(port: u16, bytes: usize) -> std::process::Child {
        let script = format!("exec 3<>/dev/tcp/127.0.0.1/{port}; head -c {bytes} <&3 | wc -c; read -r _");
        let mut bash = Command::new("bash");
        bash.args(["-c", &script]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap()
    }

    #[test]
    fn what_another_program_has_not_read_is_told_and_what_this_one_has_not_is_not() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let here = listener.local_addr().unwrap();
        let of = || unread().unwrap().into_iter().filter(|found| found.here == here).collect::<Vec<_>>();
        let _own = std::net::TcpStream::connect(here).unwrap();
        let (mut to_own, _) = listener.accept().unwrap();
        to_own.write_all(&[1; 500]).unwrap();
        assert_eq!(of(), [], "both ends are this program's");
        for taken in [0, 3000, 10_000] {
            let mut child = reader(here.port(), taken);
            let (mut to_child, _) = listener.accept().unwrap();
            to_child.write_all(&[7; 10_000]).unwrap();
            // It says when it has read them.
            let mut said = [0; 1];
            child.stdout.as_mut().unwrap().read_exact(&mut said).unwrap();
            let found = of();
            assert_eq!(found.len(), 1, "{found:?}");
            let written = found[0].written.map(|bytes| bytes / 100);
            assert_eq!((found[0].unread, written), (10_000 - taken as u64, Some(100)));
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }
}
