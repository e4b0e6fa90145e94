//! What becomes of datagrams that are sent: most arrive once.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rowscan_protocol::random::Stream;
use rowscan_settings::fault_table::datagrams::{DatagramFault, Fate};

/// Key of the random streams.
const PURPOSE: u64 = 0xDA7A;

#[derive(Debug)]
struct Active {
    key: u64,
    fault: DatagramFault,
    p: f64,
    in_burst: bool,
    dice: Stream,
}

impl Active {
    /// Whether the next datagram, of so many bytes, has the fate.
    fn hits(&mut self, bytes: usize) -> bool {
        if let Fate::InFragments { mtu } = self.fault.fate {
            let fragments = fragments(bytes, mtu);
            // All are drawn for, so that the next datagram's draws do not hang on this one's.
            let lost = (0..fragments).filter(|_| self.dice.unit() < self.p).count();
            return fragments > 1 && lost > 0;
        }
        if let Some((begins, ends)) = self.fault.bursts {
            let changes = self.dice.unit() < if self.in_burst { ends } else { begins };
            self.in_burst ^= changes;
        }
        let drawn = self.dice.unit() < self.p;
        drawn && (self.in_burst || self.fault.bursts.is_none())
    }
}

/// Packets that a datagram of so many bytes is sent in.
fn fragments(bytes: usize, mtu: u32) -> usize {
    // Offsets of fragments count in eight bytes.
    let room = (mtu as usize).saturating_sub(IP_HEADER) / 8 * 8;
    (bytes + UDP_HEADER).div_ceil(room.max(8))
}

const IP_HEADER: usize = 20;
const UDP_HEADER: usize = 8;

/// What becomes of one datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Passage {
    /// How often it arrives.
    pub copies: usize,
    /// How much later.
    pub late: Duration,
    /// How many that are sent after it arrive before it.
    pub behind: u32,
}

/// What becomes of the datagrams of one sender; clones share it.
#[derive(Clone, Debug, Default)]
pub struct Datagrams(Arc<Mutex<Vec<Active>>>);

impl Datagrams {
    /// A fault begins; each datagram is drawn for with this probability.
    pub fn begin(&self, key: u64, fault: DatagramFault, p: f64, seed: u64) {
        let active = Active { key, fault, p, in_burst: false, dice: Stream::keyed(seed, &[PURPOSE]) };
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(active);
    }

    /// The fault of this key is over, if there is one.
    pub fn end(&self, key: u64) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).retain(|active| active.key != key);
    }

    /// How often the next datagram arrives.
    pub fn copies(&self) -> usize {
        self.passage(0).copies
    }

    /// What becomes of the next datagram, which has so many bytes.
    pub fn passage(&self, bytes: usize) -> Passage {
        let mut active = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let once = Passage { copies: 1, late: Duration::ZERO, behind: 0 };
        active.iter_mut().fold(once, |passage, active| match (active.hits(bytes), active.fault.fate) {
            (false, _) => passage,
            (true, Fate::Lost | Fate::InFragments { .. }) => Passage { copies: 0, ..passage },
            (true, Fate::Doubled) => Passage { copies: 2 * passage.copies, ..passage },
            (true, Fate::Late(late)) => Passage { late: passage.late + late, ..passage },
            (true, Fate::Overtaken(behind)) => Passage { behind: passage.behind + behind, ..passage },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn copies(fate: Fate, bursts: Option<(f64, f64)>, p: f64) -> Vec<usize> {
        let datagrams = Datagrams::default();
        assert_eq!(datagrams.copies(), 1);
        datagrams.begin(1, DatagramFault { fate, bursts }, p, 7);
        let copies = (0..10_000).map(|_| datagrams.copies()).collect();
        datagrams.end(1);
        assert_eq!(datagrams.copies(), 1);
        copies
    }

    #[test]
    fn so_many_are_lost_or_doubled() {
        let lost = copies(Fate::Lost, None, 0.1).iter().filter(|copies| **copies == 0).count();
        // A standard deviation is 30.
        assert!((880..=1120).contains(&lost), "{lost}");
        assert_eq!(copies(Fate::Lost, None, 0.1), copies(Fate::Lost, None, 0.1), "seeded");
        assert!(copies(Fate::Doubled, None, 1.0).iter().all(|copies| *copies == 2));
    }

    #[test]
    fn a_datagram_is_lost_with_any_of_its_fragments() {
        let lost = |bytes: usize| {
            let datagrams = Datagrams::default();
            datagrams.begin(
                1,
                DatagramFault { fate: Fate::InFragments { mtu: 1500 }, bursts: None },
                0.02,
                7,
            );
            (0..10_000).filter(|_| datagrams.passage(bytes).copies == 0).count()
        };
        // 1480 bytes a packet, eight of them UDP's.
        assert_eq!((lost(64), lost(1472)), (0, 0));
        let expected = |fragments: i32| (1.0 - 0.98_f64.powi(fragments)) * 10_000.0;
        for (bytes, fragments) in [(1473, 2), (9108, 7), (14_160, 10)] {
            let off = lost(bytes) as f64 - expected(fragments);
            // Four standard deviations at most.
            assert!(
                off.abs() < 4.0 * expected(fragments).sqrt(),
                "{bytes}: {off} off {}",
                expected(fragments)
            );
        }
    }

    #[test]
    fn bursts_are_as_long_and_as_many_as_their_probabilities_say() {
        let all = copies(Fate::Lost, Some((0.02, 0.25)), 1.0);
        let lost = all.iter().filter(|copies| **copies == 0).count();
        let bursts = all.windows(2).filter(|pair| pair[0] == 1 && pair[1] == 0).count();
        // 0.02 / 0.27 of the time, four datagrams long each.
        assert!((550..=930).contains(&lost), "{lost}");
        let long = lost as f64 / bursts as f64;
        assert!((3.0..5.0).contains(&long), "{long}");
    }
}
