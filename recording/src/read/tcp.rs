//! TCP connections of a capture: segments in any order, sent twice, or never captured, become streams again.

use core::net::SocketAddr;

use super::segment::Segment;
use crate::Joint;

/// All connections of a capture, in the order they were seen.
#[derive(Debug, Default)]
pub(super) struct Connections {
    connections: Vec<Connection>,
}

/// One connection.
#[derive(Debug)]
struct Connection {
    /// Whoever was seen first.
    one: SocketAddr,
    other: SocketAddr,
    /// `one` opened it: its SYN was captured.
    opened: bool,
    /// When its first packet came.
    began_ns: u64,
    from_one: Flow,
    from_other: Flow,
}

/// More bytes than a usual window holds: so many can be captured before the SYN that they follow.
const EARLY: u32 = 1 << 20;

/// No SYN is sent again sooner (RFC 6298, section 2); what a capture holds twice comes within milliseconds.
const SENT_AGAIN_NS: u64 = 1_000_000_000;

/// One direction.
#[derive(Debug, Default)]
struct Flow {
    /// Sequence number of byte 0: behind the SYN, or of the first segment seen.
    anchor: Option<u32>,
    /// The SYN was seen, so `anchor` is the connection's beginning.
    from_beginning: bool,
    /// Farthest byte seen, to unwrap 32-bit numbers by.
    latest: i64,
    chunks: Vec<Chunk>,
}

/// A segment's bytes.
#[derive(Debug)]
struct Chunk {
    /// Counted from the anchor; negative before it.
    at: i64,
    bytes: Vec<u8>,
    at_ns: u64,
}

impl Connections {
    /// The next segment of the capture.
    pub(super) fn push(&mut self, segment: &Segment<'_>, at_ns: u64) {
        let known = self.connections.iter().rposition(|connection| {
            [(connection.one, connection.other), (connection.other, connection.one)]
                .contains(&(segment.from, segment.to))
        });
        // A new SYN between the same ports, of either side, is a new connection; the same one again is not.
        let index = known.filter(|&index| {
            let connection = self.connections.get_mut(index);
            !segment.syn || connection.is_some_and(|connection| connection.is_opened_by(segment, at_ns))
        });
        let index = index.unwrap_or_else(|| {
            self.connections.push(Connection {
                one: segment.from,
                other: segment.to,
                opened: false,
                began_ns: at_ns,
                from_one: Flow::default(),
                from_other: Flow::default(),
            });
            self.connections.len() - 1
        });
        if let Some(connection) = self.connections.get_mut(index) {
            connection.opened |= segment.syn && !segment.ack && segment.from == connection.one;
            connection.flow(segment.from).push(segment, at_ns);
        }
    }

    /// Both directions of every connection that carries bytes.
    pub(super) fn flows(self) -> Vec<Flows> {
        let with_bytes = self.connections.into_iter().filter(Connection::has_bytes);
        with_bytes
            .map(|connection| Flows {
                opened: connection.opened,
                one: connection.one,
                other: connection.other,
                from_one: connection.from_one.pieces(),
                from_other: connection.from_other.pieces(),
            })
            .collect()
    }
}

/// Both directions of one connection, in the order of their bytes.
#[derive(Debug)]
pub(super) struct Flows {
    /// `one` opened it: the SYN was captured.
    pub(super) opened: bool,
    pub(super) one: SocketAddr,
    pub(super) other: SocketAddr,
    pub(super) from_one: Vec<Piece>,
    pub(super) from_other: Vec<Piece>,
}

/// New bytes of one direction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    pub(super) joint: Joint,
    /// When these and all bytes before them had come.
    pub(super) at_ns: u64,
    pub(super) bytes: Vec<u8>,
}

impl Connection {
    fn flow(&mut self, from: SocketAddr) -> &mut Flow {
        if from == self.one { &mut self.from_one } else { &mut self.from_other }
    }

    /// True if a SYN of either side belongs to this connection. A client may begin each connection with the same number: a SYN that comes after bytes, and too late
    /// to be a repeated one, opens another.
    fn is_opened_by(&mut self, syn: &Segment<'_>, at_ns: u64) -> bool {
        let is_soon = at_ns < self.began_ns.saturating_add(SENT_AGAIN_NS);
        let is_over = !syn.ack && !is_soon && self.has_bytes();
        !is_over && self.flow(syn.from).is_opened_by(syn.sequence, is_soon)
    }

    fn has_bytes(&self) -> bool {
        !self.from_one.chunks.is_empty() || !self.from_other.chunks.is_empty()
    }
}

impl Flow {
    /// A SYN of that number is this flow's own; one that comes soon may be captured behind bytes that follow it.
    fn is_opened_by(&self, syn: u32, is_soon: bool) -> bool {
        let first = syn.wrapping_add(1);
        let is_late = |anchor: u32| is_soon && !self.from_beginning && anchor.wrapping_sub(first) < EARLY;
        self.anchor.is_none_or(|anchor| anchor == first || is_late(anchor))
    }

    fn push(&mut self, segment: &Segment<'_>, at_ns: u64) {
        let first = segment.sequence.wrapping_add(u32::from(segment.syn));
        let anchor = *self.anchor.get_or_insert(first);
        self.from_beginning |= segment.syn && anchor == first;
        if segment.payload.is_empty() {
            return;
        }
        let here = anchor.wrapping_add(self.latest as u32);
        // No window is larger than half the number space.
        let at = self.latest + i64::from(first.wrapping_sub(here) as i32);
        self.latest = self.latest.max(at);
        self.chunks.push(Chunk { at, bytes: segment.payload.to_vec(), at_ns });
    }

    fn pieces(mut self) -> Vec<Piece> {
        // Stable: of two segments with the same number the first counts.
        self.chunks.sort_by_key(|chunk| chunk.at);
        let begin = match self.chunks.first() {
            Some(first) if !self.from_beginning => first.at,
            _ => 0,
        };
        let mut pieces = Vec::new();
        let mut end = begin;
        let mut at_ns = 0;
        for chunk in self.chunks {
            let known = usize::try_from(end - chunk.at).unwrap_or(0);
            let Some(new) = chunk.bytes.get(known..).filter(|new| !new.is_empty()) else { continue };
            let missing = u64::try_from(chunk.at - end).unwrap_or(0);
            let joint = match (missing, pieces.is_empty(), self.from_beginning) {
                (0, true, true) => Joint::Anew,
                (0, true, false) => Joint::Inside,
                (0, false, _) => Joint::Seamless,
                (bytes, ..) => Joint::Gap { bytes, packets: 0 },
            };
            end = end.max(chunk.at) + new.len() as i64;
            // A byte is there once all before it are.
            at_ns = at_ns.max(chunk.at_ns);
            pieces.push(Piece { joint, at_ns, bytes: new.to_vec() });
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: u32 = u32::MAX - 3;

    fn addresses() -> (SocketAddr, SocketAddr) {
        ("10.0.0.1:50000".parse().unwrap(), "10.0.0.2:2112".parse().unwrap())
    }

    fn data(at: u32, payload: &[u8]) -> Segment<'_> {
        let (from, to) = addresses();
        Segment { from, to, sequence: START.wrapping_add(1 + at), syn: false, ack: true, payload }
    }

    fn syn() -> Segment<'static> {
        Segment { sequence: START, syn: true, ack: false, ..data(0, b"") }
    }

    /// Stretches without a gap, with the bytes that are missing before each, of the only flow with bytes.
    fn stretches(segments: &[Segment<'_>]) -> Vec<(String, u64)> {
        let mut connections = Connections::default();
        (0..).zip(segments).for_each(|(i, segment)| connections.push(segment, i));
        let flows = connections.flows();
        assert_eq!(flows.len(), 1);
        let mut stretches: Vec<(String, u64)> = Vec::new();
        for piece in &flows[0].from_one {
            let text = std::str::from_utf8(&piece.bytes).unwrap();
            match (piece.joint, stretches.last_mut()) {
                (Joint::Seamless, Some((stretch, _))) => stretch.push_str(text),
                (Joint::Gap { bytes, .. }, _) => stretches.push((text.to_owned(), bytes)),
                _ => stretches.push((text.to_owned(), 0)),
            }
        }
        stretches
    }

    #[test]
    fn out_of_order_and_repeated_segments_give_the_stream_over_a_wrap() {
        let whole = vec![("abcdefghij".to_owned(), 0)];
        assert_eq!(stretches(&[syn(), data(0, b"abc"), data(3, b"defg"), data(7, b"hij")]), whole);
        assert_eq!(stretches(&[syn(), data(7, b"hij"), data(0, b"abc"), data(3, b"defg")]), whole);
        assert_eq!(
            stretches(&[syn(), syn(), data(0, b"abc"), data(0, b"abcde"), data(3, b"defghij")]),
            whole
        );
        assert_eq!(stretches(&[data(3, b"defghij"), data(0, b"abc"), data(9, b"j")]), whole);
    }

    #[test]
    fn what_was_not_captured_is_counted() {
        let gap = [syn(), data(0, b"ab"), data(5, b"fg")];
        assert_eq!(stretches(&gap), [("ab".to_owned(), 0), ("fg".to_owned(), 3)]);
        assert_eq!(stretches(&[syn(), data(2, b"cd")]), [("cd".to_owned(), 2)]);
        // Without the SYN nobody knows what came before.
        assert_eq!(stretches(&gap[1..]), [("ab".to_owned(), 0), ("fg".to_owned(), 3)]);
        assert_eq!(stretches(&gap[2..]), [("fg".to_owned(), 0)]);
    }

    #[test]
    fn a_byte_has_come_when_all_before_it_have() {
        let mut connections = Connections::default();
        for (at_ns, segment) in [(1, syn()), (2, data(2, b"cd")), (3, data(0, b"ab"))] {
            connections.push(&segment, at_ns);
        }
        let flows = connections.flows();
        let times: Vec<u64> = flows[0].from_one.iter().map(|piece| piece.at_ns).collect();
        assert_eq!(times, [3, 3]);
    }

    /// Whatever numbers the two begin with (a small device may begin with the same ones each time), and whichever of the opening packets was captured.
    #[test]
    fn a_port_that_is_used_again_later_is_another_connection() {
        let (client, device) = addresses();
        let segment =
            |from, to, sequence, syn, ack, payload| Segment { from, to, sequence, syn, ack, payload };
        for (host_syn, device_syn) in
            [(776, 500), (776, 1000), (776, 900_000_000), (9, 500), (9, 1000), (4_000_000_000, 1002)]
        {
            for captured in [[true, true], [true, false], [false, true]] {
                // A device that begins with the same number is told apart by the client's SYN alone.
                if device_syn == 1000 && !captured[0] {
                    continue;
                }
                let mut connections = Connections::default();
                let mut at_ns = 0;
                let mut push = |segment: Segment<'_>, later_ns: u64| {
                    at_ns += later_ns;
                    connections.push(&segment, at_ns);
                };
                for (host, device_first, seen, bytes, later_ns) in [
                    (776_u32, 1000_u32, [true, true], &b"abcdef"[..], 0),
                    (host_syn, device_syn, captured, b"ghi", 10_000_000_000),
                ] {
                    let mut later_ns = later_ns;
                    if seen[0] {
                        push(segment(client, device, host, true, false, b""), std::mem::take(&mut later_ns));
                        // Captured twice.
                        push(segment(client, device, host, true, false, b""), 1_000_000);
                    }
                    if seen[1] {
                        push(segment(device, client, device_first, true, true, b""), later_ns);
                    }
                    push(segment(client, device, host.wrapping_add(1), false, true, b"ask"), 1_000_000);
                    push(
                        segment(device, client, device_first.wrapping_add(1), false, true, bytes),
                        1_000_000,
                    );
                    push(segment(client, device, host, true, false, b""), 1_000_000);
                }
                let flows = connections.flows();
                let streams: Vec<(bool, Vec<u8>)> = flows
                    .iter()
                    .map(|flows| {
                        let of_device = if flows.one == device { &flows.from_one } else { &flows.from_other };
                        (flows.opened, of_device.iter().flat_map(|piece| piece.bytes.clone()).collect())
                    })
                    .collect();
                let expected = [(true, b"abcdef".to_vec()), (captured[0], b"ghi".to_vec())];
                assert_eq!(streams, expected, "{host_syn}, {device_syn}, {captured:?}");
            }
        }
    }

    #[test]
    fn a_syn_that_is_captured_behind_its_bytes_opens_no_other_connection() {
        let whole = vec![("abcdefg".to_owned(), 0)];
        assert_eq!(stretches(&[data(0, b"abc"), syn(), data(3, b"defg")]), whole);
        assert_eq!(stretches(&[data(3, b"defg"), syn(), data(0, b"abc")]), whole);
        assert_eq!(stretches(&[syn(), data(0, b"abc"), syn(), data(3, b"defg")]), whole);
    }

    #[test]
    fn a_new_syn_on_the_same_ports_is_another_connection() {
        let again =
            |segment: Segment<'static>| Segment { sequence: segment.sequence.wrapping_add(99), ..segment };
        let (from, to) = addresses();
        let reply = Segment { from: to, to: from, ..data(0, b"x") };
        let mut connections = Connections::default();
        for segment in [syn(), data(0, b"ab"), reply, again(syn()), again(data(0, b"cd"))] {
            connections.push(&segment, 0);
        }
        let flows = connections.flows();
        let bytes =
            |pieces: &[Piece]| pieces.iter().flat_map(|piece| piece.bytes.clone()).collect::<Vec<u8>>();
        assert_eq!((bytes(&flows[0].from_one), bytes(&flows[0].from_other)), (b"ab".to_vec(), b"x".to_vec()));
        assert_eq!((bytes(&flows[1].from_one), bytes(&flows[1].from_other)), (b"cd".to_vec(), vec![]));
    }
}
