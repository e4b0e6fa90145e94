//! What the kernel knows of this program's TCP connections and connected UDP sockets: bytes on their way, and, where the peer runs on this
//! machine, bytes it has not read yet (`sock_diag`).

use std::collections::{HashMap, HashSet};
use std::io;
use std::net::SocketAddr;

use netlink_packet_core::{NLM_F_DUMP, NLM_F_REQUEST, NetlinkHeader, NetlinkMessage, NetlinkPayload};
use netlink_packet_sock_diag::SockDiagMessage;
use netlink_packet_sock_diag::constants::{AF_INET, AF_INET6, IPPROTO_TCP, IPPROTO_UDP, TCP_CLOSE_WAIT};
use netlink_packet_sock_diag::inet::nlas::Nla;
use netlink_packet_sock_diag::inet::{
    ExtensionFlags, InetRequest, InetResponse, InetResponseHeader, SocketId, StateFlags,
};
use netlink_sys::Socket;
use netlink_sys::protocols::NETLINK_SOCK_DIAG;

use super::bystanders::Bystanders;
use crate::processes;

/// Sockets that are looked at. One of UDP that listens is closed, by the kernel's words; of TCP the kernel keeps no closed ones.
pub(super) const TALKING: StateFlags =
    StateFlags::ESTABLISHED.union(StateFlags::CLOSE_WAIT).union(StateFlags::CLOSE);

/// Room for one answer of the kernel.
const ANSWER: usize = 64 * 1024;

/// One connection of this program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Connection {
    /// The peer's address.
    pub(super) peer: SocketAddr,
    /// Bytes that have not arrived in the peer's kernel; of a peer elsewhere, that it has not acknowledged.
    pub(super) unsent: u32,
    /// Bytes received that this program has not read.
    pub(super) unheard: u32,
    /// The other end, if it is on this machine.
    pub(super) far: Option<FarEnd>,
    /// Its peer has closed it, and hears nothing more.
    pub(super) left: bool,
    /// It sends datagrams.
    pub(super) by_datagrams: bool,
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

/// A line to the kernel. All sockets are listed only when this program's own change: that takes the kernel a hundred times as long as telling of
/// one. They are compared by their inodes: a descriptor's number is given to the next file at once.
#[derive(Debug)]
pub(super) struct Sockets {
    netlink: Socket,
    answer: Vec<u8>,
    pub(super) known: Vec<Known>,
    /// This program's listening TCP sockets.
    listeners: Vec<Named>,
    /// Inodes of this program's sockets when all were listed.
    pub(super) own: HashSet<u32>,
    /// Whose connections are left out.
    bystanders: Bystanders,
}

/// A connection of this program, as the kernel is asked for it.
#[derive(Clone, Debug)]
pub(super) struct Known {
    pub(super) peer: SocketAddr,
    pub(super) here: Named,
    pub(super) far: Option<Named>,
    pub(super) balance: Option<Balance>,
}

/// A socket as the kernel is asked for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Named {
    pub(super) protocol: u8,
    family: u8,
    id: SocketId,
}

/// Bytes that one end of a TCP connection has handled since it was opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Counts {
    /// Written by its program.
    pub(super) written: u64,
    /// Of these not acknowledged.
    pub(super) pending: u32,
    received: u64,
}

impl Counts {
    /// From the kernel's `struct tcp_info`.
    fn read(info: &[u8], pending: u32) -> Option<Self> {
        const BYTES_ACKED: usize = 120;
        const BYTES_RECEIVED: usize = 128;
        let number = |at| info.get(at..)?.first_chunk().copied().map(u64::from_ne_bytes);
        let written = number(BYTES_ACKED)?.wrapping_add(pending.into());
        Some(Self { written, pending, received: number(BYTES_RECEIVED)? })
    }
}

/// What each end has written more than the other has received. A kernel counts the opening of a connection as it likes, so only changes of this
/// say how much is on its way. Acknowledgements say it too, but a receiver may delay them by 40 ms, and does so for telegrams of equal length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Balance {
    out: u64,
    back: u64,
}

impl Balance {
    fn of(here: Counts, there: Counts) -> Self {
        Self {
            out: here.written.wrapping_sub(there.received),
            back: there.written.wrapping_sub(here.received),
        }
    }

    /// Bytes on their way to the peer, and from it, where nothing was on its way at `even`.
    fn beyond(self, even: Self) -> (u32, u32) {
        // What was written between two questions makes a count run ahead: not even either.
        let bytes = |now: u64, even: u64| u32::try_from(now.wrapping_sub(even)).unwrap_or(u32::MAX);
        (bytes(self.out, even.out), bytes(self.back, even.back))
    }
}

impl Sockets {
    pub(super) fn open(bystanders: Bystanders) -> io::Result<Self> {
        let mut netlink = Socket::new(NETLINK_SOCK_DIAG)?;
        netlink.bind_auto()?;
        netlink.connect(&netlink_sys::SocketAddr::new(0, 0))?;
        let answer = Vec::with_capacity(ANSWER);
        Ok(Self {
            netlink,
            answer,
            known: Vec::new(),
            listeners: Vec::new(),
            own: HashSet::new(),
            bystanders,
        })
    }

    /// This program's open TCP connections.
    pub(super) fn connections(&mut self) -> io::Result<Vec<Connection>> {
        let own = processes::sockets("self")?;
        if own != self.own {
            self.find(&own)?;
            self.own = own;
        }
        let connections = self.ask_all()?;
        let has_receiver = |connection: &Connection| !connection.by_datagrams || connection.far.is_some();
        if connections.iter().all(has_receiver) {
            return Ok(connections);
        }
        // A receiver of datagrams is gone, and another one may have taken its place. Where nobody has, there is nobody to wait for.
        let own = std::mem::take(&mut self.own);
        self.find(&own)?;
        self.own = own;
        Ok(self.ask_all()?.into_iter().filter(has_receiver).collect())
    }

    fn ask_all(&mut self) -> io::Result<Vec<Connection>> {
        let mut known = std::mem::take(&mut self.known);
        let connections =
            known.iter_mut().map(|known| self.connection(known)).collect::<io::Result<Vec<_>>>();
        self.known = known;
        Ok(connections?.into_iter().flatten().collect())
    }

    /// Connections to this program that it has not accepted, as of the sockets that [`Sockets::connections`] has found.
    pub(super) fn unaccepted(&mut self) -> io::Result<u32> {
        let listeners = std::mem::take(&mut self.listeners);
        // Of a listening socket the kernel counts connections, not bytes.
        let waiting =
            listeners.iter().map(|listener| Ok(self.ask(listener)?.map_or(0, |found| found.recv_queue)));
        let waiting = waiting.sum();
        self.listeners = listeners;
        waiting
    }

    /// A connection as it is now; none once it is gone.
    fn connection(&mut self, known: &mut Known) -> io::Result<Option<Connection>> {
        let Some(near) = self.ask(&known.here)? else {
            return Ok(None);
        };
        let far = known.far.as_ref().map(|far| self.ask(far)).transpose()?.flatten();
        let (mut unsent, mut unheard) = (near.send_queue, near.recv_queue);
        let end = |far: InetResponseHeader| FarEnd {
            unread: far.recv_queue,
            unsent: far.send_queue,
            inode: far.inode,
        };
        let mut far = far.map(end);
        let counted = known.here.protocol == IPPROTO_TCP;
        if let (Some(at), Some(far), true) = (&known.far, &mut far, counted) {
            let acknowledged = unsent == 0 && far.unsent == 0;
            if acknowledged && known.balance.is_none() {
                known.balance = self.even(&known.here, at)?;
            } else if !acknowledged && let Some(even) = known.balance {
                let (here, there) = (self.counts(&known.here)?, self.counts(at)?);
                // Queues are read after what has arrived in them.
                let (Some(here), Some(there), Some(near), Some(last)) =
                    (here, there, self.ask(&known.here)?, self.ask(at)?)
                else {
                    return Ok(None);
                };
                (unsent, far.unsent) = Balance::of(here, there).beyond(even);
                (unheard, far.unread) = (near.recv_queue, last.recv_queue);
            }
        }
        let left = near.state == TCP_CLOSE_WAIT && far.is_none_or(|far| far.inode == 0);
        let by_datagrams = !counted;
        Ok(Some(Connection { peer: known.peer, unsent, unheard, far, left, by_datagrams }))
    }

    /// How the counts of both ends compare while nothing is on its way; none if something is, or where the kernel has no counts.
    fn even(&mut self, here: &Named, far: &Named) -> io::Result<Option<Balance>> {
        let counts = (self.counts(here)?, self.counts(far)?, self.counts(here)?);
        let (Some(before), Some(there), Some(after)) = counts else { return Ok(None) };
        let quiet = before == after && before.pending == 0 && there.pending == 0;
        Ok(quiet.then(|| Balance::of(before, there)))
    }

    pub(super) fn counts(&mut self, socket: &Named) -> io::Result<Option<Counts>> {
        let Some(InetResponse { header, nlas }) = self.ask_with(socket, ExtensionFlags::INFO)? else {
            return Ok(None);
        };
        let info = nlas.iter().find_map(|nla| if let Nla::TcpInfo(info) = nla { Some(info) } else { None });
        Ok(info.and_then(|info| Counts::read(info, header.send_queue)))
    }

    /// Lists all sockets to find this program's connections and their other ends.
    fn find(&mut self, own: &HashSet<u32>) -> io::Result<()> {
        let mut known = self.find_udp(own)?;
        let all = self.list(IPPROTO_TCP, TALKING)?;
        let listening = self.list(IPPROTO_TCP, StateFlags::LISTEN)?;
        let by_ends: HashMap<(SocketAddr, SocketAddr), Named> =
            all.iter().map(|socket| (ends(socket), named(IPPROTO_TCP, socket))).collect();
        let takes_part = |socket: &InetResponseHeader| !self.bystanders.has(ends(socket).0);
        let mine = all.iter().filter(|socket| own.contains(&socket.inode) && takes_part(socket));
        known.extend(mine.map(|socket| {
            let (here, peer) = ends(socket);
            Known {
                peer,
                here: named(IPPROTO_TCP, socket),
                far: by_ends.get(&(peer, here)).cloned(),
                balance: None,
            }
        }));
        let mine = listening.iter().filter(|socket| own.contains(&socket.inode) && takes_part(socket));
        self.listeners = mine.map(|socket| named(IPPROTO_TCP, socket)).collect();
        // What is known of those that stay is known still.
        for known in &mut known {
            let before =
                self.known.iter().find(|before| before.here == known.here && before.far == known.far);
            known.balance = before.and_then(|before| before.balance);
        }
        self.known = known;
        Ok(())
    }

    pub(super) fn list(&mut self, protocol: u8, states: StateFlags) -> io::Result<Vec<InetResponseHeader>> {
        let mut all = Vec::new();
        for family in [AF_INET, AF_INET6] {
            let id = if family == AF_INET { SocketId::new_v4() } else { SocketId::new_v6() };
            let flags = NLM_F_REQUEST | NLM_F_DUMP;
            self.request(
                &Named { protocol, family, id },
                (flags, states.clone()),
                ExtensionFlags::empty(),
                &mut all,
            )?;
        }
        Ok(all.into_iter().map(|response| response.header).collect())
    }

    /// What the kernel knows of one socket; none if it is gone.
    pub(super) fn ask(&mut self, socket: &Named) -> io::Result<Option<InetResponseHeader>> {
        Ok(self.ask_with(socket, ExtensionFlags::empty())?.map(|response| response.header))
    }

    fn ask_with(&mut self, socket: &Named, extensions: ExtensionFlags) -> io::Result<Option<InetResponse>> {
        let (mut found, mut socket) = (Vec::new(), socket.clone());
        if socket.protocol == IPPROTO_UDP {
            // Asked for one datagram socket the kernel takes source for destination.
            let id = &mut socket.id;
            std::mem::swap(&mut id.source_address, &mut id.destination_address);
            std::mem::swap(&mut id.source_port, &mut id.destination_port);
        }
        match self.request(&socket, (NLM_F_REQUEST, TALKING), extensions, &mut found) {
            Ok(()) => Ok(found.pop()),
            // Stale: another socket has its addresses, or what the kernel keeps of it for a while.
            Err(cause)
                if matches!(
                    cause.kind(),
                    io::ErrorKind::NotFound | io::ErrorKind::StaleNetworkFileHandle
                ) =>
            {
                Ok(None)
            }
            Err(cause) => Err(cause),
        }
    }

    fn request(
        &mut self,
        socket: &Named,
        (flags, states): (u16, StateFlags),
        extensions: ExtensionFlags,
        found: &mut Vec<InetResponse>,
    ) -> io::Result<()> {
        let mut header = NetlinkHeader::default();
        header.flags = flags;
        let request = InetRequest {
            family: socket.family,
            protocol: socket.protocol,
            extensions,
            states,
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
                        found.push(*response);
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

pub(super) fn named(protocol: u8, socket: &InetResponseHeader) -> Named {
    Named { protocol, family: socket.family, id: socket.socket_id.clone() }
}

pub(super) fn ends(socket: &InetResponseHeader) -> (SocketAddr, SocketAddr) {
    let id = &socket.socket_id;
    let address = |ip: std::net::IpAddr, port| SocketAddr::new(ip.to_canonical(), port);
    (address(id.source_address, id.source_port), address(id.destination_address, id.destination_port))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};
    use std::net::{TcpListener, TcpStream, UdpSocket};

    /// Both ends of a connection: the client's, the server's.
    fn joined() -> (TcpStream, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        (client, listener.accept().unwrap().0)
    }

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
        let (mut client, mut server) = joined();
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

    #[test]
    fn it_sees_connections_that_nobody_has_accepted_and_peers_that_have_left() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut sockets = Sockets::open(Bystanders::default()).unwrap();
        // Other tests of this process listen, too.
        let address = listener.local_addr().unwrap();
        let mut unaccepted = || {
            sockets.connections().unwrap();
            sockets.listeners.retain(|named| named.id.source_port == address.port());
            sockets.unaccepted().unwrap()
        };
        assert_eq!(unaccepted(), 0);
        let file = std::fs::File::open("/dev/null").unwrap();
        let client = TcpStream::connect(address).unwrap();
        assert_eq!(unaccepted(), 1);
        // The kernel gives the lowest number that is free: the connection's descriptor is the one that the file had.
        drop(file);
        let (mut server, peer) = listener.accept().unwrap();
        assert_eq!(unaccepted(), 0);
        let mut seen = || {
            let all = sockets.connections().unwrap();
            let found = all.into_iter().find(|connection| connection.peer == peer).unwrap();
            (found.left, found.unheard)
        };
        assert_eq!(seen(), (false, 0));
        drop(client);
        // A busy kernel delivers the end a moment later, and nothing else before it.
        let first = std::iter::repeat_with(&mut seen).take(100_000).find(|seen| *seen != (false, 0));
        // Its end is one to be read.
        assert_eq!(first, Some((true, 1)));
        assert_eq!(server.read(&mut [0]).unwrap(), 0);
        assert_eq!(seen(), (true, 0));
    }

    /// A receiver delays its acknowledgements of telegrams of equal length by 40 ms, though it has read them.
    #[test]
    fn what_has_arrived_is_not_on_its_way_however_late_it_is_acknowledged() {
        let (mut client, mut server) = joined();
        let client_address = client.local_addr().unwrap();
        let mut sockets = Sockets::open(Bystanders::default()).unwrap();
        let mut to_client = || {
            let all = sockets.connections().unwrap();
            let found = all.into_iter().find(|connection| connection.peer == client_address).unwrap();
            let far = found.far.unwrap();
            [found.unsent, far.unread, found.unheard, far.unsent]
        };
        assert_eq!(to_client(), [0; 4]);
        for _ in 0..50 {
            for (waits, reverse) in [(1, false), (2, true)] {
                let (from, to) =
                    if reverse { (&mut client, &mut server) } else { (&mut server, &mut client) };
                from.write_all(&[7; 1800]).unwrap();
                let mut expected = [0; 4];
                expected[waits] = 1800;
                assert_eq!(to_client(), expected);
                to.read_exact(&mut [0; 1800]).unwrap();
                assert_eq!(to_client(), [0; 4]);
            }
        }
    }
}
