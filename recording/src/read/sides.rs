//! Which end of a captured TCP connection is the scanner.

use rowscan_protocol::frame::{Accept, FrameDecoder};
use rowscan_protocol::telegram::Telegram;

use super::StreamInfo;
use super::tcp::{Flows, Piece};
use crate::scan_reader::MAX_PAYLOAD;
use crate::{Packet, Side, StreamKind};

/// All connections' packets in the order they came, a stream a connection.
pub(super) fn packets(connections: Vec<Flows>) -> (Vec<Packet>, Vec<StreamInfo>) {
    let mut packets = Vec::new();
    let mut streams = Vec::new();
    for (stream, flows) in connections.into_iter().enumerate() {
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
        streams.push(StreamInfo { name: device.to_string(), kind: StreamKind::Cola });
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
    (packets, streams)
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
