//! When a scan was made: telegrams carry no time, so it is told from how they follow one another.

use core::time::Duration;

use crate::lms2xx::Rate;
use crate::lms2xx::model::TURNS_PER_SECOND;

/// Counts scan telegrams, those that were lost too.
#[derive(Clone, Debug, Default)]
pub(super) struct ScanClock {
    last: Option<Last>,
    /// How far the device's index goes on from one telegram to the next: the least that was seen.
    stride: Option<u8>,
    telegrams: u64,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    index: Option<u8>,
}

/// The time from one scan telegram to the next: the first multiple of the scan's own time that is not shorter than the transmission.
pub(super) fn period(rate: Rate, frame: usize, turns_a_scan: u32) -> Duration {
    let scan = scan_time(turns_a_scan);
    // Both are rounded to a nanosecond.
    let sending = rate.transmission(frame).saturating_sub(Duration::from_nanos(100));
    let scans = sending.as_nanos().div_ceil(scan.as_nanos().max(1)).max(1);
    scan.saturating_mul(u32::try_from(scans).unwrap_or(u32::MAX))
}

fn scan_time(turns_a_scan: u32) -> Duration {
    Duration::from_secs(1) * turns_a_scan / TURNS_PER_SECOND
}

impl ScanClock {
    /// The time from one telegram to the next by the mirror turns between them, once they have been counted.
    pub(super) fn period(&self, turns_a_scan: u32) -> Option<Duration> {
        let turns = u32::from(self.stride?);
        (turns > 0).then(|| scan_time(turns_a_scan).saturating_mul(turns.div_ceil(turns_a_scan.max(1))))
    }

    /// A telegram with this index came, perhaps the last one again; gives its number, lost ones counted.
    pub(super) fn count(&mut self, index: Option<u8>, again: bool) -> u64 {
        let steps = match self.last {
            None => 0,
            Some(_) if again => 0,
            Some(last) => match (last.index, index) {
                (Some(before), Some(index)) => self.steps_by_index(index.wrapping_sub(before)),
                // Nobody counts: what was lost is not known, and is not made up from times that hosts delay.
                _ => 1,
            },
        };
        self.last = Some(Last { index });
        self.telegrams += steps;
        self.telegrams
    }

    fn steps_by_index(&mut self, step: u8) -> u64 {
        if step == 0 {
            // A whole turn of the index, or a device that does not count.
            return 1;
        }
        let stride = *self.stride.get_or_insert(step).min(&mut step.clone());
        self.stride = Some(stride);
        ((u64::from(step) + u64::from(stride / 2)) / u64::from(stride)).max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_are_those_of_the_recorded_device() {
        // 361 values at 38 400: 190.6 ms on the line, 213.3 ms from scan to scan.
        assert_eq!(period(Rate::R38400, 732, 2).as_micros(), 213_333);
        assert_eq!(period(Rate::R500000, 732, 2).as_micros(), 26_666);
        assert_eq!(period(Rate::R9600, 372, 1).as_micros(), 399_999);
    }

    #[test]
    fn without_an_index_nothing_is_known_to_be_lost() {
        let mut clock = ScanClock::default();
        let counted: std::vec::Vec<u64> = (0..4).map(|_| clock.count(None, false)).collect();
        assert_eq!(counted, [0, 1, 2, 3]);
    }

    #[test]
    fn a_gap_in_the_index_is_lost_telegrams() {
        let mut clock = ScanClock::default();
        let counted: std::vec::Vec<u64> =
            [250, 10, 26, 58, 74].into_iter().map(|index| clock.count(Some(index), false)).collect();
        assert_eq!(counted, [0, 1, 2, 4, 5]);
    }

    #[test]
    fn a_gap_of_nearly_a_whole_turn_of_the_index_is_counted_too() {
        let mut clock = ScanClock::default();
        let counted: std::vec::Vec<u64> =
            [0, 16, 14].into_iter().map(|index| clock.count(Some(index), false)).collect();
        assert_eq!(counted, [0, 1, 17]);
    }
}
