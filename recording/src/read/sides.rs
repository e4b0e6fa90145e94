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
}

/// Which stream a connection belongs to. One that begins when another to the same device is over goes on with it, as after a reconnect;
/// one beside it is a second client, with a stream of its own.
fn stream_of(streams: &mut Vec<Stitched>, device: SocketAddr, begins_ns: u64, ends_ns: u64) -> usize {
    let found = streams.iter().position(|stream| stream.device == device && stream.ends_ns <= begins_ns);
    let index = found.unwrap_or_else(|| {
        streams.push(Stitched { device, ends_ns });
        streams.len() - 1
    });
    if let Some(stream) = streams.get_mut(index) {
        stream.ends_ns = stream.ends_ns.max(ends_ns);
    }
    index
}

/// A device's first stream has its address for a name, the next ones `ADDRESS/2` and on.
fn names(streams: &[Stitched]) -> Vec<StreamInfo> {
    let name = |(index, stream): (usize, &Stitched)| {
        let before = streams.iter().take(index).filter(|other| other.device == stream.device).count();
        let name = match before {
            0 => stream.device.to_string(),
            before => format!("{}/{}", stream.device, before + 1),
        };
        StreamInfo { name, kind: StreamKind::Cola }
    };
    streams.iter().enumerate().map(name).collect()
}

/// All connections' packets in the order they came; connections to one device that follow each other are one stream.
pub(super) fn packets(connections: Vec<Flows>) -> (Vec<Packet>, Vec<StreamInfo>) {
    let mut packets = Vec::new();
    let mut streams = Vec::new();
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
        for (from, pieces) in [(one, flows.from_one), (other, flows.from_other)] {
            packets.extend(pieces.into_iter().map(|Piece { joint, at_ns, bytes }| Packet {
                stream,
                from: Some(from),
                at_ns: Some(at_ns),
                joint,
                bytes,
            }));
        }
    }
    // Stable: what came at the same time stays in the order of its connection.
    packets.sort_by_key(|packet| packet.at_ns);
    (packets, names(&streams))
}

/// Who `one` is, by the first telegram of either direction.
fn first_sender(from_one: &[Piece], from_other: &[Piece]) -> Option<Side> {
    let opposite = |side| match side {
        Side::Host => Side::Device,
        Side::Device => Side::Host,
    };
    sender(from_one).or_else(|| sender(from_other).map(opposite))
}

fn sender(pieces: &[Piece]) -> Option<Side> {
    let mut decoder = FrameDecoder::new(Accept::Either, MAX_PAYLOAD);
    for piece in pieces {
        decoder.push(&piece.bytes);
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
        let (packets, streams) =
            packets(vec![connection(1, [10, 20]), connection(2, [15, 40]), connection(3, [30, 50])]);
        let names: Vec<&str> = streams.iter().map(|stream| stream.name.as_str()).collect();
        assert_eq!(names, ["10.0.0.2:2112", "10.0.0.2:2112/2"]);
        let order: Vec<(u64, usize)> =
            packets.iter().map(|packet| (packet.at_ns.unwrap(), packet.stream)).collect();
        assert_eq!(order, [(10, 0), (15, 1), (20, 0), (30, 0), (40, 1), (50, 0)]);
    }
}
