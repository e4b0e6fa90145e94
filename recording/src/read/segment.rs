//! The TCP segment, UDP datagram or fragment of one in a captured packet.

use core::net::{IpAddr, SocketAddr};

use etherparse::{IpNumber, LaxIpv4Slice, LaxNetSlice, LaxSlicedPacket, TcpSlice, TransportSlice};
use pcap_parser::Linktype;

use super::fragments::Fragment;

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

/// A UDP datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Datagram<'a> {
    pub(super) from: SocketAddr,
    pub(super) to: SocketAddr,
    pub(super) payload: &'a [u8],
}

/// What a packet carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Carried<'a> {
    Tcp(Segment<'a>),
    Udp(Datagram<'a>),
    Fragment(Fragment<'a>),
}

/// The "any" device of Linux, second version; `pcap-parser` has no name for it.
const LINUX_SLL2: Linktype = Linktype(276);

/// The segment, datagram or fragment of a datagram in a packet; `None` for all others. Of fragments, those of IPv4: no scanner sends others.
///
/// Lax: a sender that leaves segmentation to its network card writes an IP length of 0, and a capture may have cut the packet.
pub(super) fn carried(link: Linktype, packet: &[u8]) -> Option<Carried<'_>> {
    let ip = |header: usize| LaxSlicedPacket::from_ip(packet.get(header..)?).ok();
    let sliced = match link {
        Linktype::ETHERNET => LaxSlicedPacket::from_ethernet(packet).ok()?,
        // The address family, in the byte order of the capturing host or big-endian.
        Linktype::NULL | Linktype::LOOP => ip(4)?,
        // Raw IP has several numbers.
        Linktype(12 | 14) | Linktype::RAW | Linktype::IPV4 | Linktype::IPV6 => ip(0)?,
        Linktype::LINUX_SLL => ip(16)?,
        LINUX_SLL2 => ip(20)?,
        _ => return None,
    };
    let (from, to): (IpAddr, IpAddr) = match sliced.net? {
        LaxNetSlice::Ipv4(ip) if ip.payload().fragmented => return fragment(&ip).map(Carried::Fragment),
        LaxNetSlice::Ipv4(ip) => (ip.header().source_addr().into(), ip.header().destination_addr().into()),
        LaxNetSlice::Ipv6(ip) => (ip.header().source_addr().into(), ip.header().destination_addr().into()),
        _ => return None,
    };
    match sliced.transport? {
        TransportSlice::Tcp(tcp) => {
            let (from, to) =
                (SocketAddr::new(from, tcp.source_port()), SocketAddr::new(to, tcp.destination_port()));
            Some(Carried::Tcp(with_payload(from, to, &tcp)))
        }
        TransportSlice::Udp(udp) => {
            let (from, to) =
                (SocketAddr::new(from, udp.source_port()), SocketAddr::new(to, udp.destination_port()));
            Some(Carried::Udp(Datagram { from, to, payload: udp.payload() }))
        }
        _ => None,
    }
}

/// The fragment of a UDP datagram that a packet is. One that the capture has cut is none.
fn fragment<'a>(ip: &LaxIpv4Slice<'a>) -> Option<Fragment<'a>> {
    let (header, payload) = (ip.header(), ip.payload());
    let is_udp = payload.ip_number == IpNumber::UDP && !payload.incomplete;
    is_udp.then(|| Fragment {
        from: header.source_addr().into(),
        to: header.destination_addr().into(),
        number: header.identification().into(),
        at: usize::from(header.fragments_offset().byte_offset()),
        more: header.more_fragments(),
        bytes: payload.payload,
    })
}

fn with_payload<'a>(from: SocketAddr, to: SocketAddr, tcp: &TcpSlice<'a>) -> Segment<'a> {
    let (sequence, syn, ack) = (tcp.sequence_number(), tcp.syn(), tcp.ack());
    Segment { from, to, sequence, syn, ack, payload: tcp.payload() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The TCP segment in a packet.
    fn segment(link: Linktype, packet: &[u8]) -> Option<Segment<'_>> {
        match carried(link, packet)? {
            Carried::Tcp(segment) => Some(segment),
            Carried::Udp(_) | Carried::Fragment(_) => None,
        }
    }

    /// IPv4 and TCP headers before `payload`, with this length in the IP header.
    fn ipv4(total_len: u16, payload: &[u8]) -> Vec<u8> {
        let mut packet = vec![0x45, 0];
        packet.extend(total_len.to_be_bytes());
        packet.extend([0, 0, 0x40, 0, 64, 6, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2]);
        packet.extend([0x08, 0x40, 0xC3, 0x50, 0, 0, 0, 7, 0, 0, 0, 0, 0x50, 0x18, 0, 0, 0, 0, 0, 0]);
        packet.extend_from_slice(payload);
        packet
    }

    #[test]
    fn a_segment_is_found_behind_every_link_header() {
        let ip = ipv4(43, b"abc");
        let behind = |header: &[u8]| [header, &ip].concat();
        let ethernet = [&[0; 12][..], &[0x08, 0x00]].concat();
        let vlan = [&[0; 12][..], &[0x81, 0x00, 0, 5, 0x08, 0x00]].concat();
        for (link, packet) in [
            (1, behind(&ethernet)),
            (1, behind(&vlan)),
            (0, behind(&[2, 0, 0, 0])),
            (108, behind(&[0, 0, 0, 2])),
            (12, ip.clone()),
            (101, ip.clone()),
            (228, ip.clone()),
            (113, behind(&[0; 16])),
            (276, behind(&[0; 20])),
        ] {
            let segment = segment(Linktype(link), &packet).unwrap_or_else(|| panic!("link type {link}"));
            assert_eq!((segment.from.to_string(), segment.to.port()), ("10.0.0.1:2112".to_owned(), 50_000));
            assert_eq!(
                (segment.sequence, segment.syn, segment.ack, segment.payload),
                (7, false, true, &b"abc"[..])
            );
        }
        assert_eq!(segment(Linktype(9999), &ip), None);
    }

    #[test]
    fn a_datagram_is_found_and_so_is_a_fragment_of_one() {
        let udp = |fragment: [u8; 2]| {
            let mut packet = vec![0x45, 0, 0, 31, 0, 0, fragment[0], fragment[1], 64, 17, 0, 0];
            packet.extend([10, 0, 0, 1, 10, 0, 0, 2]);
            packet.extend([0x08, 0x43, 0xC3, 0x50, 0, 11, 0, 0]);
            packet.extend(b"abc");
            packet
        };
        let whole = udp([0x40, 0]);
        let Some(Carried::Udp(found)) = carried(Linktype::RAW, &whole) else { panic!("a datagram") };
        let (from, to) = ("10.0.0.1:2115".to_owned(), 50_000);
        assert_eq!((found.from.to_string(), found.to.port(), found.payload), (from, to, &b"abc"[..]));
        // More fragments follow; behind others.
        for (flags, more, at) in [([0x20, 0], true, 0), ([0x00, 4], false, 32), ([0x3F, 0xFF], true, 65_528)]
        {
            let packet = udp(flags);
            let Some(Carried::Fragment(found)) = carried(Linktype::RAW, &packet) else {
                panic!("a fragment")
            };
            assert_eq!((found.more, found.at, found.number, found.bytes), (more, at, 0, &packet[20..]));
            // Cut by the capture.
            assert_eq!(carried(Linktype::RAW, &packet[..30]), None);
        }
    }

    #[test]
    fn the_ip_length_cuts_padding_and_a_length_of_zero_is_the_capture_s() {
        for (total_len, expected) in [(43, &b"abc"[..]), (41, b"a"), (0, b"abc"), (400, b"abc")] {
            let packet = ipv4(total_len, b"abc");
            assert_eq!(
                segment(Linktype::RAW, &packet).map(|segment| segment.payload),
                Some(expected),
                "{total_len}"
            );
        }
    }

    #[test]
    fn ipv6_is_read_and_cut_packets_are_not() {
        let mut packet = vec![0x60, 0, 0, 0, 0, 21, 6, 64];
        packet.extend([0; 15]);
        packet.push(1);
        packet.extend([0; 15]);
        packet.push(2);
        packet.extend_from_slice(&ipv4(41, b"x")[20..]);
        let found = segment(Linktype::RAW, &packet).expect("a segment");
        assert_eq!((found.from.to_string(), found.payload), ("[::1]:2112".to_owned(), &b"x"[..]));
        for end in 0..60 {
            assert_eq!(segment(Linktype::RAW, &packet[..end]), None, "{end} bytes");
        }
    }
}
