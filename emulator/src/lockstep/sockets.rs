//! What the kernel knows of this program's TCP connections and connected UDP sockets: bytes on their way, and, where the peer runs on this
//! machine, bytes it has not read yet (`sock_diag`).

use std::collections::{HashMap, HashSet};
use std::io;
use std::net::SocketAddr;

use netlink_packet_core::{NLM_F_DUMP, NLM_F_REQUEST, NetlinkHeader, NetlinkMessage, NetlinkPayload};
use netlink_packet_sock_diag::SockDiagMessage;
use netlink_packet_sock_diag::constants::{AF_INET, AF_INET6, IPPROTO_TCP, IPPROTO_UDP};
use netlink_packet_sock_diag::inet::{ExtensionFlags, InetRequest, InetResponseHeader, SocketId, StateFlags};
use netlink_sys::Socket;
use netlink_sys::protocols::NETLINK_SOCK_DIAG;

use super::bystanders::Bystanders;
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
    /// Whose connections are left out.
    bystanders: Bystanders,
}

/// A connection of this program, as the kernel is asked for it.
#[derive(Clone, Debug)]
struct Known {
    peer: SocketAddr,
    here: Named,
    far: Option<Named>,
}

/// A socket as the kernel is asked for it.
#[derive(Clone, Debug)]
struct Named {
    protocol: u8,
    family: u8,
    id: SocketId,
}

impl Sockets {
    pub(super) fn open(bystanders: Bystanders) -> io::Result<Self> {
        let mut netlink = Socket::new(NETLINK_SOCK_DIAG)?;
        netlink.bind_auto()?;
        netlink.connect(&netlink_sys::SocketAddr::new(0, 0))?;
        let (answer, known) = (Vec::with_capacity(ANSWER), Vec::new());
        Ok(Self { netlink, answer, known, descriptors: Vec::new(), bystanders })
    }

    /// This program's open TCP connections.
    pub(super) fn connections(&mut self) -> io::Result<Vec<Connection>> {
        let descriptors = processes::descriptors()?;
        if descriptors != self.descriptors {
            self.find()?;
            self.descriptors = descriptors;
        }
        let known = std::mem::take(&mut self.known);
        let connections = known.iter().map(|known| self.connection(known)).collect::<io::Result<Vec<_>>>();
        self.known = known;
        Ok(connections?.into_iter().flatten().collect())
    }

    /// A connection as it is now; none once it is gone.
    fn connection(&mut self, Known { peer, here, far }: &Known) -> io::Result<Option<Connection>> {
        let Some(near) = self.ask(here)? else {
            // Its descriptor may be another's.
            self.descriptors.clear();
            return Ok(None);
        };
        let far = far.as_ref().map(|far| self.ask(far)).transpose()?.flatten();
        let far = far.map(|far| FarEnd { unread: far.recv_queue, unsent: far.send_queue, inode: far.inode });
        Ok(Some(Connection { peer: *peer, unsent: near.send_queue, unheard: near.recv_queue, far }))
    }

    /// Lists all sockets to find this program's connections and their other ends.
    fn find(&mut self) -> io::Result<()> {
        let own = processes::sockets("self")?;
        let mut known = self.find_udp(&own)?;
        let all = self.list(IPPROTO_TCP)?;
        let by_ends: HashMap<(SocketAddr, SocketAddr), Named> =
            all.iter().map(|socket| (ends(socket), named(IPPROTO_TCP, socket))).collect();
        let takes_part = |socket: &InetResponseHeader| !self.bystanders.has(ends(socket).0);
        let mine = all.iter().filter(|socket| own.contains(&socket.inode) && takes_part(socket));
        known.extend(mine.map(|socket| {
            let (here, peer) = ends(socket);
            Known { peer, here: named(IPPROTO_TCP, socket), far: by_ends.get(&(peer, here)).cloned() }
        }));
        self.known = known;
        Ok(())
    }

    /// This program's UDP sockets that send to one place, where somebody on this machine listens. Where nobody does there is nobody to wait for.
    fn find_udp(&mut self, own: &HashSet<u32>) -> io::Result<Vec<Known>> {
        let all = self.list(IPPROTO_UDP)?;
        let sending = all.iter().filter(|socket| own.contains(&socket.inode) && ends(socket).1.port() != 0);
        let known = sending.filter_map(|socket| {
            let peer = ends(socket).1;
            let listens = |other: &&InetResponseHeader| {
                let (at, from) = ends(other);
                at.port() == peer.port()
                    && from.port() == 0
                    && (at.ip() == peer.ip() || at.ip().is_unspecified())
            };
            let far = all.iter().find(listens)?;
            Some(Known { peer, here: named(IPPROTO_UDP, socket), far: Some(named(IPPROTO_UDP, far)) })
        });
        Ok(known.collect())
    }

    fn list(&mut self, protocol: u8) -> io::Result<Vec<InetResponseHeader>> {
        let mut all = Vec::new();
        for family in [AF_INET, AF_INET6] {
            let id = if family == AF_INET { SocketId::new_v4() } else { SocketId::new_v6() };
            let flags = NLM_F_REQUEST | NLM_F_DUMP;
            self.request(&Named { protocol, family, id }, flags, &mut all)?;
        }
        Ok(all)
    }

    /// What the kernel knows of one socket; none if it is gone.
    fn ask(&mut self, socket: &Named) -> io::Result<Option<InetResponseHeader>> {
        let mut found = Vec::new();
        match self.request(socket, NLM_F_REQUEST, &mut found) {
            Ok(()) => Ok(found.pop()),
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(cause) => Err(cause),
        }
    }

    fn request(&mut self, socket: &Named, flags: u16, found: &mut Vec<InetResponseHeader>) -> io::Result<()> {
        let mut header = NetlinkHeader::default();
        header.flags = flags;
        let request = InetRequest {
            family: socket.family,
            protocol: socket.protocol,
            extensions: ExtensionFlags::empty(),
            // A UDP socket that listens is closed, by the kernel's words.
            states: StateFlags::ESTABLISHED
                | if socket.protocol == IPPROTO_UDP { StateFlags::CLOSE } else { StateFlags::CLOSE_WAIT },
            socket_id: socket.id.clone(),
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

fn named(protocol: u8, socket: &InetResponseHeader) -> Named {
    Named { protocol, family: socket.family, id: socket.socket_id.clone() }
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
    use std::net::{TcpListener, TcpStream, UdpSocket};

    #[test]
    fn it_sees_whether_a_receiver_of_datagrams_has_read_them() {
        for there in ["127.0.0.1:0", "0.0.0.0:0"] {
            let receiver = UdpSocket::bind(there).unwrap();
            let sender = UdpSocket::bind("0.0.0.0:0").unwrap();
            let port = receiver.local_addr().unwrap().port();
            sender.connect(("127.0.0.1", port)).unwrap();
            let mut sockets = Sockets::open(Bystanders::default()).unwrap();
            let mut unread = || {
                let all = sockets.connections().unwrap();
                let found = all.into_iter().find(|connection| connection.peer.port() == port);
                found.and_then(|connection| connection.far).map(|far| far.unread)
            };
            assert_eq!(unread(), Some(0), "{there}");
            sender.send(b"$GPGGA").unwrap();
            assert!(unread() > Some(0), "{there}");
            receiver.recv(&mut [0; 64]).unwrap();
            assert_eq!(unread(), Some(0), "{there}");
        }
    }

    #[test]
    fn it_sees_what_a_peer_on_this_machine_has_not_read() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (mut server, _) = listener.accept().unwrap();
        let client_address = client.local_addr().unwrap();
        let mut sockets = Sockets::open(Bystanders::default()).unwrap();
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
        let bystanders = Bystanders::default();
        bystanders.add(server.local_addr().unwrap());
        let all = Sockets::open(bystanders).unwrap().connections().unwrap();
        assert!(all.iter().all(|connection| connection.peer != client_address), "{all:?}");
    }
}
