//! One captured packet: link, IP and TCP headers off.

use core::net::{IpAddr, SocketAddr};

/// How packets begin, as pcap numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LinkType(pub(super) u32);

/// What TCP says about some bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Segment<'a> {
    pub(super) from: SocketAddr,
    pub(super) to: SocketAddr,
    /// Number of the first byte of `payload`, or of the SYN.
    pub(super) sequence: u32,
    /// Opens a connection.
    pub(super) syn: bool,
    /// Acknowledges something.
    pub(super) ack: bool,
    pub(super) payload: &'a [u8],
}

const IPV4: u16 = 0x0800;
const IPV6: u16 = 0x86DD;
/// Ethernet types that lead a VLAN tag.
const VLAN: [u16; 2] = [0x8100, 0x88A8];
const TCP: u8 = 6;
const SYN: u8 = 0x02;
const ACK: u8 = 0x10;

/// The TCP segment in a packet; none in all others.
pub(super) fn segment(link: LinkType, packet: &[u8]) -> Option<Segment<'_>> {
    let ip = match link.0 {
        // Ethernet.
        1 => ethernet(packet.get(12..)?)?,
        // Loopback: address family, in the host's byte order or big-endian.
        0 | 108 => packet.get(4..)?,
        // Raw IP, with several numbers.
        12 | 14 | 101 | 228 | 229 => packet,
        // Linux "any" device, two versions.
        113 => packet.get(16..)?,
        276 => packet.get(20..)?,
        _ => return None,
    };
    match ip.first()? >> 4 {
        4 => ipv4(ip),
        6 => ipv6(ip),
        _ => None,
    }
}

fn ethernet(mut rest: &[u8]) -> Option<&[u8]> {
    loop {
        let (kind, after) = rest.split_first_chunk::<2>()?;
        match u16::from_be_bytes(*kind) {
            IPV4 | IPV6 => return Some(after),
            tag if VLAN.contains(&tag) => rest = after.get(2..)?,
            _ => return None,
        }
    }
}

fn ipv4(ip: &[u8]) -> Option<Segment<'_>> {
    let header = usize::from(ip.first()? & 0x0F) * 4;
    // A later fragment has no TCP header.
    let is_fragment = be16(ip, 6)? & 0x1FFF != 0;
    if *ip.get(9)? != TCP || is_fragment {
        return None;
    }
    let address = |at: usize| Some(IpAddr::from(*ip.get(at..)?.first_chunk::<4>()?));
    // Ethernet pads short packets; a sender that leaves cutting to its card writes 0.
    let end = match usize::from(be16(ip, 2)?) {
        0 => ip.len(),
        total => total.min(ip.len()),
    };
    tcp(address(12)?, address(16)?, ip.get(header..end)?)
}

fn ipv6(ip: &[u8]) -> Option<Segment<'_>> {
    // Without extension headers, which no scanner sends.
    if *ip.get(6)? != TCP {
        return None;
    }
    let address = |at: usize| Some(IpAddr::from(*ip.get(at..)?.first_chunk::<16>()?));
    let end = match usize::from(be16(ip, 4)?) {
        0 => ip.len(),
        payload => (40 + payload).min(ip.len()),
    };
    tcp(address(8)?, address(24)?, ip.get(40..end)?)
}

fn tcp(from: IpAddr, to: IpAddr, tcp: &[u8]) -> Option<Segment<'_>> {
    let header = usize::from(tcp.get(12)? >> 4) * 4;
    let flags = *tcp.get(13)?;
    Some(Segment {
        from: SocketAddr::new(from, be16(tcp, 0)?),
        to: SocketAddr::new(to, be16(tcp, 2)?),
        sequence: u32::from_be_bytes(*tcp.get(4..)?.first_chunk()?),
        syn: flags & SYN != 0,
        ack: flags & ACK != 0,
        payload: tcp.get(header..)?,
    })
}

fn be16(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes(*bytes.get(at..)?.first_chunk()?))
}
