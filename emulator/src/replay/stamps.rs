//! Counters and times of replayed scans: as recorded, or as a scanner would have them now.

use rowscan_protocol::telegram::LmdScandata;
use rowscan_protocol::time::SimTime;

/// What becomes of counters and device times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stamps {
    /// They stay as recorded; a loop begins with the first ones again.
    #[default]
    Keep,
    /// Times are those of the replay, counters run on over loops; gaps in them stay. The calendar stays as recorded.
    Now,
}

/// Rewrites scan after scan.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Restamp {
    /// Telegram counter and scan counter.
    last: Option<(Counter, Counter)>,
    /// How long before the replay the scanner was powered up, µs: so long that its first scan came after that.
    up_before_us: u64,
}

#[derive(Clone, Copy, Debug)]
struct Counter {
    recorded: u16,
    sent: u16,
}

impl Restamp {
    /// Stamps `scan` as sent at `at`; after a jump on the tape it counts on by one.
    pub(crate) fn stamp(&mut self, scan: &mut LmdScandata, at: SimTime, jumped: bool) {
        let recorded = (scan.telegram_counter, scan.scan_counter);
        let flight_us = u64::from(scan.transmit_time_us.wrapping_sub(scan.scan_time_us));
        let at_us = at.0 / 1000;
        let sent = match self.last {
            None => {
                self.up_before_us = flight_us.saturating_sub(at_us);
                recorded
            }
            Some(last) => {
                let on = |recorded: u16, last: Counter| {
                    let step = if jumped { 1 } else { recorded.wrapping_sub(last.recorded) };
                    last.sent.wrapping_add(step)
                };
                (on(recorded.0, last.0), on(recorded.1, last.1))
            }
        };
        let counter = |recorded, sent| Counter { recorded, sent };
        self.last = Some((counter(recorded.0, sent.0), counter(recorded.1, sent.1)));
        (scan.telegram_counter, scan.scan_counter) = sent;
        let transmit_us = at_us + self.up_before_us;
        // The device's clock is 32 bits wide and wraps.
        scan.transmit_time_us = transmit_us as u32;
        scan.scan_time_us = transmit_us.saturating_sub(flight_us) as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_run_on_over_a_loop_and_keep_their_gaps() {
        let mut restamp = Restamp::default();
        let mut sent = Vec::new();
        for (counter, jumped) in [(7, false), (8, false), (11, false), (7, true), (8, false)] {
            let mut scan = LmdScandata {
                telegram_counter: counter,
                scan_counter: counter,
                scan_time_us: 100,
                transmit_time_us: 350,
                ..LmdScandata::default()
            };
            restamp.stamp(&mut scan, SimTime(5_000_000), jumped);
            sent.push(scan.telegram_counter);
            assert_eq!((scan.scan_time_us, scan.transmit_time_us), (4_750, 5_000));
        }
        assert_eq!(sent, [7, 8, 11, 12, 13]);
    }

    #[test]
    fn no_scan_is_from_before_power_up() {
        let mut restamp = Restamp::default();
        // µs: when it is sent, how long after its zero index, what it tells.
        for (at_us, flight_us, expected) in
            [(0, 40_853, (0, 40_853)), (40_000, 40_730, (40_123, 80_853)), (80_000, 200_000, (0, 120_853))]
        {
            let mut scan =
                LmdScandata { scan_time_us: u32::MAX, transmit_time_us: flight_us - 1, ..Default::default() };
            restamp.stamp(&mut scan, SimTime(at_us * 1000), false);
            assert_eq!((scan.scan_time_us, scan.transmit_time_us), expected);
        }
    }
}
