//! TCP connections of a capture: segments in any order, sent twice, or never captured, become streams again.

use std::net::SocketAddr;

use super::packet::Segment;
use super::{Piece, Stream};

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
    from_one: Flow,
    from_other: Flow,
}

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
    time_s: f64,
}

impl Connections {
    /// The next segment of the capture.
    pub(super) fn push(&mut self, segment: &Segment<'_>, time_s: f64) {
        let known = self.connections.iter().rposition(|connection| {
            [(connection.one, connection.other), (connection.other, connection.one)]
                .contains(&(segment.from, segment.to))
        });
        // A new SYN between the same ports is a new connection; the same one again is not.
        let opens = segment.syn && !segment.ack;
        let index = known.filter(|&index| {
            let flow = self.connections.get_mut(index).map(|connection| connection.flow(segment.from));
            !opens || flow.is_some_and(|flow| flow.is_opened_by(segment.sequence))
        });
        let index = index.unwrap_or_else(|| {
            self.connections.push(Connection {
                one: segment.from,
                other: segment.to,
                from_one: Flow::default(),
                from_other: Flow::default(),
            });
            self.connections.len() - 1
        });
        if let Some(connection) = self.connections.get_mut(index) {
            connection.flow(segment.from).push(segment, time_s);
        }
    }

    /// Both directions of every connection that carries bytes.
    pub(super) fn streams(self) -> Vec<Vec<Stream>> {
        let with_bytes = self.connections.into_iter().filter(Connection::has_bytes);
        (1..)
            .zip(with_bytes)
            .map(|(number, connection)| {
                [connection.from_one, connection.from_other]
                    .map(|flow| Stream { connection: Some(number), ..flow.stream() })
                    .into()
            })
            .collect()
    }
}

impl Connection {
    fn flow(&mut self, from: SocketAddr) -> &mut Flow {
        if from == self.one { &mut self.from_one } else { &mut self.from_other }
    }

    fn has_bytes(&self) -> bool {
        !self.from_one.chunks.is_empty() || !self.from_other.chunks.is_empty()
    }
}

impl Flow {
    /// A SYN of that number is this flow's own.
    fn is_opened_by(&self, syn: u32) -> bool {
        let first = syn.wrapping_add(1);
        self.anchor.is_none_or(|anchor| self.from_beginning && anchor == first)
    }

    fn push(&mut self, segment: &Segment<'_>, time_s: f64) {
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
        self.chunks.push(Chunk { at, bytes: segment.payload.to_vec(), time_s });
    }

    fn stream(mut self) -> Stream {
        // Stable: of two segments with the same number the first counts.
        self.chunks.sort_by_key(|chunk| chunk.at);
        let begin = match self.chunks.first() {
            Some(first) if !self.from_beginning => first.at,
            _ => 0,
        };
        let mut stream = Stream::default();
        let mut end = begin;
        let mut time_s = f64::NEG_INFINITY;
        for chunk in self.chunks {
            let known = usize::try_from(end - chunk.at).unwrap_or(0);
            let Some(new) = chunk.bytes.get(known..).filter(|new| !new.is_empty()) else { continue };
            let missing_before = u64::try_from(chunk.at - end).unwrap_or(0);
            let at = end.max(chunk.at);
            if missing_before > 0 || stream.pieces.is_empty() {
                stream.pieces.push(Piece {
                    offset: at.abs_diff(begin),
                    bytes: Vec::new(),
                    missing_before,
                    begins_inside: !self.from_beginning && stream.pieces.is_empty(),
                });
            }
            if let Some(piece) = stream.pieces.last_mut() {
                piece.bytes.extend_from_slice(new);
            }
            end = at + new.len() as i64;
            // A byte is there once all before it are.
            time_s = time_s.max(chunk.time_s);
            stream.times.push((end.abs_diff(begin), time_s));
        }
        stream
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

    /// Bytes and what is missing before them, of the only stream with bytes.
    fn pieces(segments: &[Segment<'_>]) -> Vec<(u64, String, u64)> {
        let mut connections = Connections::default();
        segments.iter().enumerate().for_each(|(i, segment)| connections.push(segment, i as f64));
        let streams = connections.streams();
        assert_eq!(streams.len(), 1);
        let piece = |p: &Piece| (p.offset, String::from_utf8(p.bytes.clone()).unwrap(), p.missing_before);
        streams[0][0].pieces.iter().map(piece).collect()
    }

    #[test]
    fn out_of_order_and_repeated_segments_give_the_stream_over_a_wrap() {
        let whole = vec![(0, "abcdefghij".to_owned(), 0)];
        assert_eq!(pieces(&[syn(), data(0, b"abc"), data(3, b"defg"), data(7, b"hij")]), whole);
        assert_eq!(pieces(&[syn(), data(7, b"hij"), data(0, b"abc"), data(3, b"defg")]), whole);
        assert_eq!(pieces(&[syn(), syn(), data(0, b"abc"), data(0, b"abcde"), data(3, b"defghij")]), whole);
        assert_eq!(pieces(&[data(3, b"defghij"), data(0, b"abc"), data(9, b"j")]), whole);
    }

    #[test]
    fn what_was_not_captured_is_counted() {
        let gap = [syn(), data(0, b"ab"), data(5, b"fg")];
        assert_eq!(pieces(&gap), [(0, "ab".to_owned(), 0), (5, "fg".to_owned(), 3)]);
        assert_eq!(pieces(&[syn(), data(2, b"cd")]), [(2, "cd".to_owned(), 2)]);
        // Without the SYN nobody knows what came before.
        assert_eq!(pieces(&gap[1..]), [(0, "ab".to_owned(), 0), (5, "fg".to_owned(), 3)]);
        assert_eq!(pieces(&gap[2..]), [(0, "fg".to_owned(), 0)]);
    }

    #[test]
    fn a_byte_has_come_when_all_before_it_have() {
        let mut connections = Connections::default();
        for (time_s, segment) in [(1.0, syn()), (2.0, data(2, b"cd")), (3.0, data(0, b"ab"))] {
            connections.push(&segment, time_s);
        }
        let streams = connections.streams();
        assert_eq!(streams[0][0].times, [(2, 3.0), (4, 3.0)]);
    }

    #[test]
    fn a_new_syn_on_the_same_ports_is_another_connection() {
        let again =
            |segment: Segment<'static>| Segment { sequence: segment.sequence.wrapping_add(99), ..segment };
        let (from, to) = addresses();
        let reply = Segment { from: to, to: from, ..data(0, b"x") };
        let mut connections = Connections::default();
        for segment in [syn(), data(0, b"ab"), reply, again(syn()), again(data(0, b"cd"))] {
            connections.push(&segment, 0.0);
        }
        let streams = connections.streams();
        let bytes =
            |c: usize, s: usize| streams[c][s].pieces.iter().map(|p| p.bytes.clone()).collect::<Vec<_>>();
        assert_eq!((bytes(0, 0), bytes(0, 1)), (vec![b"ab".to_vec()], vec![b"x".to_vec()]));
        assert_eq!((bytes(1, 0), bytes(1, 1)), (vec![b"cd".to_vec()], vec![]));
    }
}
