//! Which end of a captured TCP connection is the scanner.

use core::net::SocketAddr;

use rowscan_protocol::frame::{Accept, FrameDecoder};
use rowscan_protocol::telegram::Telegram;

use super::StreamInfo;
use super::tcp::{Flows, Piece};
use crate::scan_reader::MAX_PAYLOAD;
use crate::{Packet, Side, StreamKind};

/// A stream being put together of connections to one device.
struct Stitched {
    device: SocketAddr,
    ends_ns: u64,
    /// Connections so far.
    connections: usize,
}

/// Which stream a connection belongs to. One that begins when another to the same device is over goes on with it, as after a reconnect;
/// one beside it is a second client, with a stream of its own.
fn stream_of(streams: &mut Vec<Stitched>, device: SocketAddr, begins_ns: u64, ends_ns: u64) -> usize {
    let found = streams.iter().position(|stream| stream.device == device && stream.ends_ns <= begins_ns);
    let index = found.unwrap_or_else(|| {
        streams.push(Stitched { device, ends_ns, connections: 0 });
        streams.len() - 1
    });
    if let Some(stream) = streams.get_mut(index) {
        stream.ends_ns = stream.ends_ns.max(ends_ns);
        stream.connections += 1;
    }
    index
}

/// What stream number `index` is of its device's, from 1.
fn number(streams: &[Stitched], index: usize) -> usize {
    let device = streams.get(index).map(|stream| stream.device);
    streams.iter().take(index + 1).filter(|other| Some(other.device) == device).count()
}

/// A device's first stream has its address for a name, the next ones `ADDRESS/2` and on; a stream's connections are `ADDRESS/1.1`,
/// `ADDRESS/1.2` and on.
fn names(streams: &[Stitched]) -> Vec<StreamInfo> {
    let name = |(index, stream): (usize, &Stitched)| {
        let (device, number) = (stream.device, number(streams, index));
        let name = if number == 1 { device.to_string() } else { format!("{device}/{number}") };
        let connections = match stream.connections {
            0 | 1 => Vec::new(),
            several => (1..=several).map(|connection| connection_name(device, number, connection)).collect(),
        };
        StreamInfo { connections, ..StreamInfo::new(name, StreamKind::Cola) }
    };
    streams.iter().enumerate().map(name).collect()
}

fn connection_name(device: SocketAddr, stream: usize, connection: usize) -> String {
    format!("{device}/{stream}.{connection}")
}

/// All connections' packets in the order they came. Connections to one device that follow each other are one stream, but for those
/// whose names stand in `apart`: these are streams of their own, behind the others.
pub(super) fn packets(connections: Vec<Flows>, apart: &[&str]) -> (Vec<Packet>, Vec<StreamInfo>) {
    let mut packets = Vec::new();
    let (mut streams, mut alone) = (Vec::new(), Vec::new());
    for flows in connections {
        let one = first_sender(&flows.from_one, &flows.from_other).unwrap_or(match flows.opened {
            true => Side::Host,
            // Servers sit on the lower port.
            false if flows.one.port() > flows.other.port() => Side::Host,
            false => Side::Device,
        });
        let (other, device) = match one {
            Side::Host => (Side::Device, flows.other),
            Side::Device => (Side::Host, flows.one),
        };
        let times = || flows.from_one.iter().chain(&flows.from_other).map(|piece| piece.at_ns);
        let (begins_ns, ends_ns) = (times().min().unwrap_or(0), times().max().unwrap_or(0));
        let stream = stream_of(&mut streams, device, begins_ns, ends_ns);
        let connection = streams.get(stream).map_or(1, |stream| stream.connections);
        let name = connection_name(device, number(&streams, stream), connection);
        let place = if apart.contains(&name.as_str()) {
            alone.push(StreamInfo::new(name, StreamKind::Cola));
            Place::Alone(alone.len() - 1)
        } else {
            Place::Stitched(stream)
        };
        for (from, pieces) in [(one, flows.from_one), (other, flows.from_other)] {
            packets.extend(pieces.into_iter().map(|Piece { joint, at_ns, bytes }| {
                (place, Packet { stream: 0, from: Some(from), at_ns: Some(at_ns), joint, bytes })
            }));
        }
    }
    // Stable: what came at the same time stays in the order of its connection.
    packets.sort_by_key(|(_, packet)| packet.at_ns);
    let stream = |place| match place {
        Place::Stitched(stream) => stream,
        Place::Alone(number) => streams.len() + number,
    };
    let packets =
        packets.into_iter().map(|(place, packet)| Packet { stream: stream(place), ..packet }).collect();
    (packets, names(&streams).into_iter().chain(alone).collect())
}

/// Where a connection's packets go.
#[derive(Clone, Copy)]
enum Place {
    Stitched(usize),
    Alone(usize),
}

/// Who `one` is, by the first telegram of either direction.
fn first_sender(from_one: &[Piece], from_other: &[Piece]) -> Option<Side> {
    let opposite = |side| match side {
        Side::Host => Side::Device,
        Side::Device => Side::Host,
    };
    let of = |pieces: &[Piece]| sender(pieces.iter().map(|piece| piece.bytes.as_slice()));
    of(from_one).or_else(|| of(from_other).map(opposite))
}

/// Who sends the first telegram of these bytes, which come in pieces; none where there is none.
pub(super) fn sender<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> Option<Side> {
    let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
    for piece in pieces {
        decoder.push(piece);
        while let Some(frame) = decoder.next_frame() {
            if let Ok(telegram) = Telegram::parse(frame.dialect, frame.payload) {
                return Some(Side::of(telegram.kind));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Joint;

    #[test]
    fn a_reconnect_goes_on_and_a_second_client_stands_beside() {
        let connection = |port: u16, times: [u64; 2]| Flows {
            opened: true,
            one: SocketAddr::from(([10, 0, 0, 1], port)),
            other: SocketAddr::from(([10, 0, 0, 2], 2112)),
            from_one: Vec::new(),
            from_other: times
                .map(|at_ns| Piece {
                    joint: Joint::Anew,
                    at_ns,
                    bytes: b"\x02sRA LMDscandata 1\x03".to_vec(),
                })
                .to_vec(),
        };
        let connections = || vec![connection(1, [10, 20]), connection(2, [15, 40]), connection(3, [30, 50])];
        let order = |packets: &[Packet]| -> Vec<(u64, usize)> {
            packets.iter().map(|packet| (packet.at_ns.unwrap(), packet.stream)).collect()
        };
        let names = |streams: &[StreamInfo]| -> Vec<String> {
            streams.iter().map(|stream| stream.name.clone()).collect()
        };
        let (all, streams) = packets(connections(), &[]);
        assert_eq!(names(&streams), ["10.0.0.2:2112", "10.0.0.2:2112/2"]);
        assert_eq!(streams[0].connections, ["10.0.0.2:2112/1.1", "10.0.0.2:2112/1.2"]);
        assert!(streams[1].connections.is_empty(), "a connection alone is its stream");
        assert_eq!(order(&all), [(10, 0), (15, 1), (20, 0), (30, 0), (40, 1), (50, 0)]);
        let (apart, streams) = packets(connections(), &["10.0.0.2:2112/1.2", "10.0.0.2:2112/9.9"]);
        assert_eq!(names(&streams), ["10.0.0.2:2112", "10.0.0.2:2112/2", "10.0.0.2:2112/1.2"]);
        assert_eq!(order(&apart), [(10, 0), (15, 1), (20, 0), (30, 2), (40, 1), (50, 2)]);
    }
}
