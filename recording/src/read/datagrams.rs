//! UDP datagrams of scanners in a capture: each is a Compact telegram.

use core::net::SocketAddr;

use rowscan_protocol::compact;

use super::StreamInfo;
use super::fragments::Lost;
use super::segment::Datagram;
use crate::{Joint, Packet, Side, StreamKind};

/// Datagrams of a capture, a stream for each way they go.
#[derive(Debug, Default)]
pub(super) struct Datagrams {
    /// From whom to whom.
    ways: Vec<(SocketAddr, SocketAddr)>,
    packets: Vec<Packet>,
}

impl Datagrams {
    /// The next datagram of the capture. One that does not begin like a Compact telegram is somebody else's.
    pub(super) fn push(&mut self, datagram: &Datagram<'_>, at_ns: u64) {
        if !compact::begins(datagram.payload) {
            return;
        }
        let way = (datagram.from, datagram.to);
        let stream = self.ways.iter().position(|known| *known == way).unwrap_or_else(|| {
            self.ways.push(way);
            self.ways.len() - 1
        });
        self.packets.push(Packet {
            stream,
            from: Some(Side::Device),
            at_ns: Some(at_ns),
            // A datagram that is damaged takes nothing of the next one.
            joint: Joint::Anew,
            bytes: datagram.payload.to_vec(),
        });
    }

    /// Takes note of a datagram that did not become whole: the next one between the same two is behind a gap.
    pub(super) fn lose(&mut self, lost: Lost) {
        let Self { ways, packets } = self;
        let is_way = |stream: usize| {
            ways.get(stream).is_some_and(|(from, to)| (from.ip(), to.ip()) == (lost.from, lost.to))
        };
        let next =
            packets.iter_mut().find(|packet| packet.at_ns >= Some(lost.at_ns) && is_way(packet.stream));
        if let Some(packet) = next {
            packet.joint = match packet.joint {
                Joint::Gap { bytes, packets } => Joint::Gap { bytes, packets: packets + 1 },
                _ => Joint::Gap { bytes: 0, packets: 1 },
            };
        }
    }

    /// Adds them to the streams of a capture and to its packets, in the order they came.
    pub(super) fn join(self, packets: &mut Vec<Packet>, streams: &mut Vec<StreamInfo>) {
        if self.packets.is_empty() {
            return;
        }
        let before = streams.len();
        streams.extend(
            self.ways
                .iter()
                .map(|(from, to)| StreamInfo::new(format!("udp://{from} to {to}"), StreamKind::Compact)),
        );
        let place = |packet: Packet| Packet { stream: before + packet.stream, ..packet };
        packets.extend(self.packets.into_iter().map(place));
        packets.sort_by_key(|packet| packet.at_ns);
    }
}
