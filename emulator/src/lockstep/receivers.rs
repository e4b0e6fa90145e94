//! Who receives this program's datagrams: sockets of this machine that listen where they go.

use std::collections::HashSet;
use std::io;
use std::net::{SocketAddr, SocketAddrV4};

use netlink_packet_sock_diag::constants::IPPROTO_UDP;
use netlink_packet_sock_diag::inet::InetResponseHeader;

use super::sockets::{Known, Sockets, TALKING, ends, named};

impl Sockets {
    /// This program's UDP sockets that send to one place, where somebody on this machine listens. Where nobody does there is nobody to wait for.
    pub(super) fn find_udp(&mut self, own: &HashSet<u32>) -> io::Result<Vec<Known>> {
        let all = self.list(IPPROTO_UDP, TALKING)?;
        let sending = all.iter().filter(|socket| own.contains(&socket.inode) && ends(socket).1.port() != 0);
        let known = sending.filter_map(|socket| {
            let peer = ends(socket).1;
            let far = all.iter().find(|other| listens(other, peer))?;
            let (here, far) = (named(IPPROTO_UDP, socket), Some(named(IPPROTO_UDP, far)));
            Some(Known { peer, here, far, balance: None })
        });
        Ok(known.collect())
    }

    /// Whether somebody on this machine listens for datagrams to `to`.
    pub(super) fn has_receiver(&mut self, to: SocketAddrV4) -> io::Result<bool> {
        let to = SocketAddr::from(to);
        let found = self.list(IPPROTO_UDP, TALKING)?.iter().any(|socket| listens(socket, to));
        if found && self.known.iter().all(|known| known.peer != to) {
            // All are listed anew: what is sent there is to be waited for.
            self.own.clear();
        }
        Ok(found)
    }
}

/// True of a socket that receives datagrams to `to` from anybody.
pub(super) fn listens(socket: &InetResponseHeader, to: SocketAddr) -> bool {
    let (at, from) = ends(socket);
    at.port() == to.port() && from.port() == 0 && (at.ip() == to.ip() || at.ip().is_unspecified())
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;

    use super::super::bystanders::Bystanders;
    use super::*;

    /// The bytes that the receiver at `port` has not read; none where nobody receives.
    fn unread(sockets: &mut Sockets, port: u16) -> Option<u32> {
        let all = sockets.connections().unwrap();
        all.into_iter().find(|connection| connection.peer.port() == port)?.far.map(|far| far.unread)
    }

    /// Waits until nobody receives there. A socket that was closed lives on for a moment where another thread's child has it until its program begins.
    fn left(sockets: &mut Sockets, to: SocketAddrV4) {
        let gone = (0..100_000).any(|_| {
            std::thread::yield_now();
            !sockets.has_receiver(to).unwrap()
        });
        assert!(gone, "somebody still receives at {to}");
    }

    /// A receiver there, as soon as no other one is left.
    fn bound(to: SocketAddrV4) -> UdpSocket {
        let again = |_| {
            std::thread::yield_now();
            match UdpSocket::bind(to) {
                Err(cause) if cause.kind() == std::io::ErrorKind::AddrInUse => None,
                bound => Some(bound.unwrap()),
            }
        };
        (0..1_000_000).find_map(again).unwrap()
    }

    #[test]
    fn a_receiver_that_comes_goes_and_comes_again_is_waited_for() {
        let mut sockets = Sockets::open(Bystanders::default()).unwrap();
        // Below the ports that the system hands out: nobody else takes it between two owners.
        let begin = 20_000 + u16::try_from(std::process::id() % 9_000).unwrap();
        let port = (begin..).find(|port| UdpSocket::bind(("127.0.0.1", *port)).is_ok()).unwrap();
        let to = SocketAddrV4::new(std::net::Ipv4Addr::LOCALHOST, port);
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        sender.connect(to).unwrap();
        for _ in 0..2 {
            left(&mut sockets, to);
            assert_eq!(unread(&mut sockets, port), None);
            let receiver = bound(to);
            assert_eq!((sockets.has_receiver(to).unwrap(), unread(&mut sockets, port)), (true, Some(0)));
            sender.send(b"segment").unwrap();
            assert!(unread(&mut sockets, port) > Some(0));
            // Another one in its place, before anybody has looked.
            drop(receiver);
            let other = bound(to);
            assert_eq!(unread(&mut sockets, port), Some(0));
            drop(other);
        }
    }
}
