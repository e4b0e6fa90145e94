//! What happens again and again, and is not told every time.

use std::sync::atomic::{AtomicU64, Ordering};

/// Counts events of one kind. Those of number 1, 2, 4, 8 … are worth a message: a flood fills no log, and none goes unseen.
#[derive(Debug, Default)]
pub struct Tally(AtomicU64);

impl Tally {
    /// Counts one; how many there have been, if it is to be told.
    pub fn count(&self) -> Option<u64> {
        let so_far = self.0.fetch_add(1, Ordering::Relaxed) + 1;
        so_far.is_power_of_two().then_some(so_far)
    }

    /// How many there have been.
    pub fn total(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousand_events_are_ten_messages() {
        let tally = Tally::default();
        let told: Vec<u64> = (0..1000).filter_map(|_| tally.count()).collect();
        assert_eq!((told.len(), told.last(), tally.total()), (10, Some(&512), 1000));
    }
}
