//! What clients have not read: bytes that wait in the kernel, on either side, for the program at a connection's other end.

use std::io;
use std::net::SocketAddr;

use netlink_packet_sock_diag::constants::{IPPROTO_TCP, IPPROTO_UDP};

use super::Unread;
use super::bystanders::Bystanders;
use super::receivers::listens;
use super::sockets::{Sockets, TALKING, ends};
use crate::processes;

/// This program's TCP connections with other programs of this machine, and what these have not read.
///
/// # Errors
/// Where the kernel does not tell (sock_diag).
pub fn unread() -> io::Result<Vec<Unread>> {
    let mut sockets = Sockets::open(Bystanders::default())?;
    sockets.connections()?;
    let mut found = Vec::new();
    for known in sockets.known.clone() {
        let Some(far) = known.far.filter(|_| known.here.protocol == IPPROTO_TCP) else { continue };
        let (far, near) = (sockets.ask(&far)?, sockets.ask(&known.here)?);
        let (Some(far), Some(near), Some(counts)) = (far, near, sockets.counts(&known.here)?) else {
            continue;
        };
        if !sockets.own.contains(&far.inode) {
            let unread = u64::from(far.recv_queue) + u64::from(counts.pending);
            found.push(Unread { here: ends(&near).0, written: counts.written, unread });
        }
    }
    Ok(found)
}

/// The memory of datagrams to `to` that another program of this machine has not read, bytes; what did not fit is dropped. 0 where none receives there.
///
/// # Errors
/// Where the kernel does not tell (sock_diag).
pub fn unread_datagrams(to: SocketAddr) -> io::Result<u64> {
    let own = processes::sockets("self")?;
    let all = Sockets::open(Bystanders::default())?.list(IPPROTO_UDP, TALKING)?;
    let theirs = all.iter().filter(|socket| listens(socket, to) && !own.contains(&socket.inode));
    Ok(theirs.map(|socket| u64::from(socket.recv_queue)).max().unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead as _, Read as _, Write as _};
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
            assert_eq!((found[0].unread, found[0].written / 100), (10_000 - taken as u64, 100));
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }

    #[test]
    fn datagrams_that_another_program_has_not_read_are_told() {
        let sender = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
        let own = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
        sender.send_to(&[1; 1000], own.local_addr().unwrap()).unwrap();
        assert_eq!(unread_datagrams(own.local_addr().unwrap()).unwrap(), 0, "it is this program's");
        let script = "import socket, sys\ns = socket.socket(type=socket.SOCK_DGRAM)\ns.bind(('127.0.0.1', 0))\n\
                      print(s.getsockname()[1], flush=True)\nsys.stdin.readline()\ns.recv(2000)\nprint(flush=True)\nsys.stdin.readline()\n";
        let mut python = Command::new("python3");
        let spawned = python.args(["-c", script]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        // A machine without Python.
        let Ok(mut child) = spawned else { return };
        let mut said = std::io::BufReader::new(child.stdout.take().unwrap()).lines();
        let port: u16 = said.next().unwrap().unwrap().parse().unwrap();
        let to = SocketAddr::from(([127, 0, 0, 1], port));
        assert_eq!(unread_datagrams(to).unwrap(), 0);
        sender.send_to(&[1; 1000], to).unwrap();
        assert!(unread_datagrams(to).unwrap() >= 1000);
        child.stdin.as_mut().unwrap().write_all(b"\n").unwrap();
        said.next().unwrap().unwrap();
        assert_eq!(unread_datagrams(to).unwrap(), 0);
        child.kill().unwrap();
        child.wait().unwrap();
    }
}
