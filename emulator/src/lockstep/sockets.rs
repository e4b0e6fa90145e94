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

use super::processes;

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

/// A line to the kernel. All sockets are listed only when this program's descriptors change: that takes the kernel a hundred times as long as
/// telling of one.
#[derive(Debug)]
pub(super) struct Sockets {
    netlink: Socket,
    answer: Vec<u8>,
    known: Vec<Known>,
    /// Descriptors open when the sockets were listed.
    descriptors: Vec<u32>,
}

/// A connection of this program, as the kernel is asked for it.
#[derive(Clone, Debug)]
struct Known {
    peer: SocketAddr,
    here: (u8, SocketId),
    far: Option<(u8, SocketId)>,
}

impl Sockets {
    pub(super) fn open() -> io::Result<Self> {
        let mut netlink = Socket::new(NETLINK_SOCK_DIAG)?;
        netlink.bind_auto()?;
        netlink.connect(&netlink_sys::SocketAddr::new(0, 0))?;
        let (answer, known) = (Vec::with_capacity(ANSWER), Vec::new());
        Ok(Self { netlink, answer, known, descriptors: Vec::new() })
    }

    /// This program's open TCP connections.
    pub(super) fn connections(&mut self) -> io::Result<Vec<Connection>> {
        let descriptors = processes::descriptors()?;
        if descriptors != self.descriptors {
            self.find()?;
            self.descriptors = descriptors;
        }
        let mut connections = Vec::new();
        for Known { peer, here, far } in self.known.clone() {
            let Some(near) = self.ask(&here)? else {
                // Gone meanwhile, and its descriptor may be another's.
                self.descriptors.clear();
                continue;
            };
            let far = far.map(|far| self.ask(&far)).transpose()?.flatten();
            let far =
                far.map(|far| FarEnd { unread: far.recv_queue, unsent: far.send_queue, inode: far.inode });
            connections.push(Connection { peer, unsent: near.send_queue, unheard: near.recv_queue, far });
        }
        Ok(connections)
    }

    /// Lists all sockets to find this program's connections and their other ends.
    fn find(&mut self) -> io::Result<()> {
        let mut all = Vec::new();
        for family in [AF_INET, AF_INET6] {
            let socket_id = if family == AF_INET { SocketId::new_v4() } else { SocketId::new_v6() };
            self.request(family, socket_id, NLM_F_REQUEST | NLM_F_DUMP, &mut all)?;
        }
        let own = processes::sockets("self")?;
        let named = |socket: &InetResponseHeader| (socket.family, socket.socket_id.clone());
        let by_ends: HashMap<(SocketAddr, SocketAddr), (u8, SocketId)> =
            all.iter().map(|socket| (ends(socket), named(socket))).collect();
        let mine = all.iter().filter(|socket| own.contains(&socket.inode));
        self.known = mine
            .map(|socket| {
                let (here, peer) = ends(socket);
                Known { peer, here: named(socket), far: by_ends.get(&(peer, here)).cloned() }
            })
            .collect();
        Ok(())
    }

    /// What the kernel knows of one socket; none if it is gone.
    fn ask(&mut self, (family, socket_id): &(u8, SocketId)) -> io::Result<Option<InetResponseHeader>> {
        let mut found = Vec::new();
        match self.request(*family, socket_id.clone(), NLM_F_REQUEST, &mut found) {
            Ok(()) => Ok(found.pop()),
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(cause) => Err(cause),
        }
    }

    fn request(
        &mut self,
        family: u8,
        socket_id: SocketId,
        flags: u16,
        found: &mut Vec<InetResponseHeader>,
    ) -> io::Result<()> {
        let mut header = NetlinkHeader::default();
        header.flags = flags;
        let request = InetRequest {
            family,
            protocol: IPPROTO_TCP,
            extensions: ExtensionFlags::empty(),
            states: StateFlags::ESTABLISHED | StateFlags::CLOSE_WAIT,
            socket_id,
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
            if flags & NLM_F_DUMP != NLM_F_DUMP {
                return Ok(());
            }
        }
    }
}

fn ends(socket: &InetResponseHeader) -> (SocketAddr, SocketAddr) {
    let id = &socket.socket_id;
    let address = |ip: std::net::IpAddr, port| SocketAddr::new(ip.to_canonical(), port);
    (address(id.source_address, id.source_port), address(id.destination_address, id.destination_port))
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
