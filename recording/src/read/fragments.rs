//! UDP datagrams that were captured in fragments, put together. One of which a fragment is missing is lost, and counted.

use core::net::{IpAddr, SocketAddr};

/// Datagrams whose fragments are waited for at once; the oldest is given up for the next one.
const MAX_WAITING: usize = 64;
/// Fragments that come later than that are of another datagram with the same number, ns: as long as systems wait.
const PATIENCE_NS: u64 = 30_000_000_000;
/// Most bytes of a datagram.
const MAX_BYTES: usize = 65_535;
const UDP_HEADER: usize = 8;

/// A fragment of a UDP datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Fragment<'a> {
    pub(super) from: IpAddr,
    pub(super) to: IpAddr,
    /// The number that all fragments of a datagram have.
    pub(super) number: u32,
    /// Where its bytes belong.
    pub(super) at: usize,
    /// Others follow behind.
    pub(super) more: bool,
    pub(super) bytes: &'a [u8],
}

/// A datagram that has been put together.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Whole {
    pub(super) from: SocketAddr,
    pub(super) to: SocketAddr,
    pub(super) payload: Vec<u8>,
}

/// One that was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lost {
    pub(super) from: IpAddr,
    pub(super) to: IpAddr,
    /// When its last fragment came.
    pub(super) at_ns: u64,
}

/// Puts fragments together.
#[derive(Debug, Default)]
pub(super) struct Fragments {
    /// In the order in which their first fragments came.
    waiting: Vec<Waiting>,
    lost: Vec<Lost>,
}

#[derive(Debug)]
struct Waiting {
    from: IpAddr,
    to: IpAddr,
    number: u32,
    began_ns: u64,
    at_ns: u64,
    /// Bytes with their places, none over another.
    pieces: Vec<(usize, Vec<u8>)>,
    /// How many bytes it has, once its end is known.
    length: Option<usize>,
}

impl Fragments {
    /// The next fragment of the capture; the datagram, if it is complete with it.
    pub(super) fn push(&mut self, fragment: &Fragment<'_>, at_ns: u64) -> Option<Whole> {
        let is_of = |waiting: &Waiting| {
            (waiting.from, waiting.to, waiting.number) == (fragment.from, fragment.to, fragment.number)
        };
        let is_late = |waiting: &Waiting| at_ns.saturating_sub(waiting.began_ns) > PATIENCE_NS;
        let mut place = self.waiting.iter().position(is_of);
        if let Some(stale) = place.filter(|place| self.waiting.get(*place).is_some_and(is_late)) {
            self.give_up(stale);
            place = None;
        }
        let place = place.unwrap_or_else(|| {
            if self.waiting.len() >= MAX_WAITING {
                self.give_up(0);
            }
            let Fragment { from, to, number, .. } = *fragment;
            let (began_ns, pieces) = (at_ns, Vec::new());
            self.waiting.push(Waiting { from, to, number, began_ns, at_ns, pieces, length: None });
            self.waiting.len() - 1
        });
        let waiting = self.waiting.get_mut(place)?;
        waiting.take(fragment, at_ns);
        if !waiting.is_whole() {
            return None;
        }
        self.waiting.remove(place).datagram()
    }

    fn give_up(&mut self, place: usize) {
        let Waiting { from, to, at_ns, .. } = self.waiting.remove(place);
        self.lost.push(Lost { from, to, at_ns });
    }

    /// The capture is over: all that have not become whole, and those given up before.
    pub(super) fn lost(mut self) -> Vec<Lost> {
        while !self.waiting.is_empty() {
            self.give_up(0);
        }
        self.lost
    }
}

impl Waiting {
    /// A fragment that is empty, or comes again, or over others, or beyond what a datagram can have, adds nothing.
    fn take(&mut self, fragment: &Fragment<'_>, at_ns: u64) {
        let (from, to) = (fragment.at, fragment.at + fragment.bytes.len());
        let is_over = |(at, bytes): &(usize, Vec<u8>)| from < at + bytes.len() && *at < to;
        if fragment.bytes.is_empty() || to > MAX_BYTES || self.pieces.iter().any(is_over) {
            return;
        }
        self.at_ns = at_ns;
        self.pieces.push((from, fragment.bytes.to_vec()));
        if !fragment.more {
            self.length = Some(to);
        }
    }

    fn is_whole(&self) -> bool {
        self.length == Some(self.pieces.iter().map(|(_, bytes)| bytes.len()).sum())
    }

    fn datagram(mut self) -> Option<Whole> {
        self.pieces.sort_by_key(|(at, _)| *at);
        let bytes: Vec<u8> = self.pieces.into_iter().flat_map(|(_, bytes)| bytes).collect();
        let (header, payload) = bytes.split_at_checked(UDP_HEADER)?;
        let &[a, b, c, d, high, low, ..] = header else { return None };
        let length = usize::from(u16::from_be_bytes([high, low])).checked_sub(UDP_HEADER)?;
        let payload = payload.get(..length)?.to_vec();
        let port = |high, low| u16::from_be_bytes([high, low]);
        let (from, to) = (SocketAddr::new(self.from, port(a, b)), SocketAddr::new(self.to, port(c, d)));
        Some(Whole { from, to, payload })
    }
}

#[cfg(test)]
mod tests {
    use core::net::Ipv4Addr;

    use super::*;

    const SCANNER: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 1));
    const HOST: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 2));

    /// Place, whether others follow, bytes.
    type Piece = (usize, bool, Vec<u8>);

    /// A datagram of so many bytes, and its fragments for packets of 1500 bytes.
    fn fragments(number: u32, bytes: usize) -> (Vec<u8>, Vec<Piece>) {
        let payload: Vec<u8> = (0..bytes).map(|place| (place as u32 * 7 + number) as u8).collect();
        let length = ((UDP_HEADER + bytes) as u16).to_be_bytes();
        let udp = [&[0x08, 0x43, 0xC3, 0x50, length[0], length[1], 0, 0], &payload[..]].concat();
        let count = udp.chunks(1480).len();
        let cut = udp.chunks(1480).enumerate();
        let cut = cut.map(|(place, bytes)| (place * 1480, place + 1 < count, bytes.to_vec())).collect();
        (payload, cut)
    }

    fn fragment(number: u32, (at, more, bytes): &Piece) -> Fragment<'_> {
        Fragment { from: SCANNER, to: HOST, number, at: *at, more: *more, bytes }
    }

    #[test]
    fn fragments_in_any_order_and_of_several_datagrams_are_put_together() {
        let (first, mut one) = fragments(1, 14_160);
        let (second, two) = fragments(2, 3000);
        assert_eq!((one.len(), two.len()), (10, 3));
        one.reverse();
        one.swap(2, 7);
        let mut joined = Fragments::default();
        let mut whole = Vec::new();
        for (place, piece) in one.iter().enumerate() {
            whole.extend(joined.push(&fragment(1, piece), 0));
            // Each again.
            whole.extend(joined.push(&fragment(1, piece), 0));
            whole.extend(two.get(place).and_then(|two| joined.push(&fragment(2, two), 0)));
        }
        let payloads: Vec<&Vec<u8>> = whole.iter().map(|whole| &whole.payload).collect();
        assert_eq!(payloads, [&second, &first]);
        assert!(whole.iter().all(|whole| whole.from == SocketAddr::new(SCANNER, 2115)));
        // The last one came again when all was there: it waits for others that never come.
        assert_eq!(joined.lost().len(), 1);
    }

    #[test]
    fn a_datagram_with_a_fragment_missing_is_lost_and_counted() {
        for missing in 0..10 {
            let (_, cut) = fragments(5, 14_160);
            let mut joined = Fragments::default();
            let came = cut.iter().enumerate().filter(|(place, _)| *place != missing);
            assert!(came.map(|(_, piece)| joined.push(&fragment(5, piece), 9)).all(|whole| whole.is_none()));
            assert_eq!(joined.lost(), [Lost { from: SCANNER, to: HOST, at_ns: 9 }], "{missing}");
        }
    }

    #[test]
    fn a_number_that_comes_again_much_later_is_another_datagram() {
        let (payload, cut) = fragments(5, 3000);
        let mut joined = Fragments::default();
        assert_eq!(joined.push(&fragment(5, &cut[0]), 0), None);
        let later = PATIENCE_NS + 1;
        let whole: Vec<_> = cut.iter().filter_map(|piece| joined.push(&fragment(5, piece), later)).collect();
        assert_eq!(whole.iter().map(|whole| &whole.payload).collect::<Vec<_>>(), [&payload]);
        assert_eq!(joined.lost().len(), 1);
    }

    #[test]
    fn memory_is_bounded_whatever_comes() {
        let mut joined = Fragments::default();
        let bytes = vec![0; 1480];
        for number in 0..10_000 {
            for at in [0, 1480, 64_000, 65_528] {
                let piece = (at, number % 2 == 0, bytes.clone());
                joined.push(&fragment(number, &piece), 0);
            }
        }
        assert_eq!(joined.waiting.len(), MAX_WAITING);
        assert!(joined.waiting.iter().all(|waiting| waiting.pieces.len() <= 3));
        assert_eq!(joined.lost().len(), 10_000);
    }
}
