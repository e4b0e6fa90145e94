//! What becomes of datagrams that are sent: most arrive once.

use std::sync::{Arc, Mutex, PoisonError};

use rowscan_fault_table::datagrams::{DatagramFault, Fate};
use rowscan_protocol::random::Stream;

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
    /// Whether the next datagram has the fate.
    fn hits(&mut self) -> bool {
        if let Some((begins, ends)) = self.fault.bursts {
            let changes = self.dice.unit() < if self.in_burst { ends } else { begins };
            self.in_burst ^= changes;
        }
        let drawn = self.dice.unit() < self.p;
        drawn && (self.in_burst || self.fault.bursts.is_none())
    }
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
        let mut active = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        active.iter_mut().fold(1, |copies, active| match (active.hits(), active.fault.fate) {
            (false, _) => copies,
            (true, Fate::Lost) => 0,
            (true, Fate::Doubled) => 2 * copies,
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
