//! What a stream of datagrams and answers hands over with one read: a mark, and then all of one of them; of a datagram the socket address it came from first.

use std::net::{IpAddr, Ipv6Addr, SocketAddr};

/// A datagram.
pub(super) const DATAGRAM: u8 = 0;
/// An answer to the request before.
pub(super) const ANSWER: u8 = 1;

/// Bytes of an address: as IPv6, and its port.
const PLACE: usize = 16 + 2;
/// Bytes before a datagram's own.
pub(super) const HEAD: usize = 1 + PLACE;

/// What stands before a datagram that came from `from`.
pub(super) fn datagram_head(from: SocketAddr) -> [u8; HEAD] {
    let ip = match from.ip() {
        IpAddr::V4(ip) => ip.to_ipv6_mapped(),
        IpAddr::V6(ip) => ip,
    };
    let mut head = [DATAGRAM; HEAD];
    let bytes = ip.octets().into_iter().chain(from.port().to_be_bytes());
    head.iter_mut().skip(1).zip(bytes).for_each(|(byte, value)| *byte = value);
    head
}

/// Where a datagram came from, and its bytes; of a piece behind its mark.
pub(super) fn datagram(piece: &[u8]) -> Option<(SocketAddr, &[u8])> {
    let (place, bytes) = piece.split_first_chunk::<PLACE>()?;
    let (ip, port) = place.split_first_chunk::<16>()?;
    let ip = Ipv6Addr::from(*ip).to_canonical();
    Some((SocketAddr::new(ip, u16::from_be_bytes(*port.first_chunk()?)), bytes))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;

    #[test]
    fn a_datagram_keeps_its_place() {
        for place in ["10.0.0.1:2115", "[fe80::1]:7503"] {
            let from: SocketAddr = place.parse().unwrap();
            let piece = [&datagram_head(from)[..], b"bytes"].concat();
            assert_eq!((piece[0], datagram(&piece[1..])), (DATAGRAM, Some((from, &b"bytes"[..]))));
        }
        assert_eq!(datagram(&[0; PLACE - 1]), None);
    }
}
