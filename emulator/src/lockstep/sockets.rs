//! What the kernel knows of this program's TCP connections: bytes on their way, and, where the peer runs on this machine, bytes it has not
//! read yet (`sock_diag`).

use std::collections::HashMap;
use std::io;
use std::net::SocketAddr;

use netlink_packet_core::{NLM_F_DUMP, NLM_F_REQUEST, NetlinkHeader, NetlinkMessage, NetlinkPayload};
use netlink_packet_sock_diag::SockDiagMessage;
use netlink_packet_sock_diag::constants::{AF_INET, AF_INET6, IPPROTO_TCP};
use netlink_packet_sock_diag::inet::{ExtensionFlags, InetRequest, InetResponseHeader, SocketId, StateFlags};
use netlink_sys::Socket;
use netlink_sys::protocols::NETLINK_SOCK_DIAG;

/// Room for one answer of the kernel.
const ANSWER: usize = 64 * 1024;

/// One connection of this program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Connection {
    /// The peer's address.
    pub(super) peer: SocketAddr,
    /// Bytes that the peer's kernel has not acknowledged.
    pub(super) unsent: u32,
    /// Bytes received that this program has not read.
    pub(super) unheard: u32,
    /// The other end, if it is on this machine.
    pub(super) far: Option<FarEnd>,
}

/// A connection as its peer has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FarEnd {
    /// Bytes that the peer has not read.
    pub(super) unread: u32,
    /// Bytes of the peer that have not arrived.
    pub(super) unsent: u32,
    /// The peer's socket, as `/proc` names it.
    pub(super) inode: u32,
}

/// A line to the kernel.
#[derive(Debug)]
pub(super) struct Sockets {
    netlink: Socket,
    answer: Vec<u8>,
    /// Whether a socket is this program's, by its number.
    own: HashMap<u32, bool>,
}

impl Sockets {
    pub(super) fn open() -> io::Result<Self> {
        let mut netlink = Socket::new(NETLINK_SOCK_DIAG)?;
        netlink.bind_auto()?;
        netlink.connect(&netlink_sys::SocketAddr::new(0, 0))?;
        Ok(Self { netlink, answer: Vec::with_capacity(ANSWER), own: HashMap::new() })
    }

    /// This program's open TCP connections.
    pub(super) fn connections(&mut self) -> io::Result<Vec<Connection>> {
        let mut all = Vec::new();
        for family in [AF_INET, AF_INET6] {
            self.dump(family, &mut all)?;
        }
        if all.iter().any(|socket| !self.own.contains_key(&socket.inode)) {
            let own = own_sockets()?;
            self.own = all.iter().map(|socket| (socket.inode, own.contains(&socket.inode))).collect();
        }
        let by_ends: HashMap<(SocketAddr, SocketAddr), &InetResponseHeader> =
            all.iter().map(|socket| (ends(socket), socket)).collect();
        let mine = all.iter().filter(|socket| self.own.get(&socket.inode).copied().unwrap_or(false));
        Ok(mine
            .map(|socket| {
                let (here, peer) = ends(socket);
                let far = by_ends.get(&(peer, here)).map(|far| FarEnd {
                    unread: far.recv_queue,
                    unsent: far.send_queue,
                    inode: far.inode,
                });
                Connection { peer, unsent: socket.send_queue, unheard: socket.recv_queue, far }
            })
            .collect())
    }

    /// All established connections of a family.
    fn dump(&mut self, family: u8, found: &mut Vec<InetResponseHeader>) -> io::Result<()> {
        let mut header = NetlinkHeader::default();
        header.flags = NLM_F_REQUEST | NLM_F_DUMP;
        let request = InetRequest {
            family,
            protocol: IPPROTO_TCP,
            extensions: ExtensionFlags::empty(),
            states: StateFlags::ESTABLISHED | StateFlags::CLOSE_WAIT,
            socket_id: if family == AF_INET { SocketId::new_v4() } else { SocketId::new_v6() },
        };
        let mut message = NetlinkMessage::new(header, SockDiagMessage::InetRequest(request).into());
        message.finalize();
        let mut bytes = vec![0; message.buffer_len()];
        message.serialize(&mut bytes);
        self.netlink.send(&bytes, 0)?;
        loop {
            self.answer.clear();
            let size = self.netlink.recv(&mut self.answer, 0)?;
            let mut rest = self.answer.get(..size).unwrap_or_default();
            while !rest.is_empty() {
                let message =
                    NetlinkMessage::<SockDiagMessage>::deserialize(rest).map_err(io::Error::other)?;
                let length = message.header.length as usize;
                match message.payload {
                    NetlinkPayload::InnerMessage(SockDiagMessage::InetResponse(response)) => {
                        found.push(response.header);
                    }
                    NetlinkPayload::Error(error) => return Err(error.to_io()),
                    NetlinkPayload::Done(_) => return Ok(()),
                    _ => {}
                }
                // Messages begin at multiples of four bytes.
                rest = rest.get(length.next_multiple_of(4).max(4)..).unwrap_or_default();
            }
        }
    }
}

fn ends(socket: &InetResponseHeader) -> (SocketAddr, SocketAddr) {
    let id = &socket.socket_id;
    let address = |ip: std::net::IpAddr, port| SocketAddr::new(ip.to_canonical(), port);
    (address(id.source_address, id.source_port), address(id.destination_address, id.destination_port))
}

/// The sockets this program has open.
fn own_sockets() -> io::Result<std::collections::HashSet<u32>> {
    super::processes::sockets("self")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};
    use std::net::{TcpListener, TcpStream};

    #[test]
    fn it_sees_what_a_peer_on_this_machine_has_not_read() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (mut server, _) = listener.accept().unwrap();
        let client_address = client.local_addr().unwrap();
        let mut sockets = Sockets::open().unwrap();
        let mut to_client = || {
            let all = sockets.connections().unwrap();
            all.into_iter().find(|connection| connection.peer == client_address).unwrap()
        };
        assert_eq!(to_client().far.map(|far| far.unread), Some(0));
        server.write_all(&[7; 1234]).unwrap();
        assert_eq!(to_client().far.map(|far| far.unread), Some(1234));
        client.read_exact(&mut [0; 1000]).unwrap();
        assert_eq!(to_client().far.map(|far| far.unread), Some(234));
        client.write_all(&[7; 5]).unwrap();
        assert_eq!(to_client().unheard, 5);
    }
}
