//! When a mirror passes its zero index.

use rowscan_protocol::device::Mirror;
use rowscan_protocol::time::SimTime;

/// When the mirror passes its zero index: absolute instants epoch + n·T, never a sum of periods.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turns {
    epoch: SimTime,
    turned: u64,
    frequency_centihz: u32,
    period_ppm: i32,
}

impl Turns {
    pub(crate) fn new(epoch: SimTime, mirror: Mirror) -> Self {
        Self {
            epoch,
            turned: 0,
            frequency_centihz: mirror.frequency_centihz.max(1),
            period_ppm: mirror.period_ppm,
        }
    }

    /// The next turn's instant.
    pub(crate) fn next(&self) -> SimTime {
        SimTime(self.epoch.0 + period_times(self.turned, self.frequency_centihz, self.period_ppm))
    }

    /// The instant of the turn after the next one.
    pub(crate) fn after(&self, mirror: Mirror) -> SimTime {
        let mut turns = Self { ..*self };
        turns.advance(mirror);
        turns.next()
    }

    /// On to the turn after; a changed frequency starts a new epoch there.
    pub(crate) fn advance(&mut self, mirror: Mirror) {
        if mirror.frequency_centihz == self.frequency_centihz {
            self.turned += 1;
        } else {
            *self = Self::new(self.next(), mirror);
            self.turned = 1;
        }
    }
}

/// `n` scan periods in ns, exact to the last one; each `ppm` parts per million longer than nominal.
fn period_times(n: u64, frequency_centihz: u32, ppm: i32) -> u64 {
    let stretch = 1_000_000 + i128::from(ppm);
    (i128::from(n) * 100_000 * stretch / i128::from(frequency_centihz)) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::angle::BeamGrid;

    fn mirror(frequency_centihz: u32) -> Mirror {
        let beams = BeamGrid::spanning(-450_000, 2_250_000, 5000);
        Mirror { frequency_centihz, period_ppm: 0, beams, suppresses_fog: false, layer_centideg: 0 }
    }

    #[test]
    fn ten_hours_of_turns_do_not_drift() {
        // 15 Hz: a period that no whole number of nanoseconds holds.
        let mut turns = Turns::new(SimTime::ZERO, mirror(1500));
        for _ in 0..15 * 36_000 {
            turns.advance(mirror(1500));
        }
        assert_eq!(turns.next(), SimTime(36_000_000_000_000));
    }

    #[test]
    fn a_recorded_period_is_kept() {
        let slow = Mirror { period_ppm: 5_600, ..mirror(5000) };
        let mut turns = Turns::new(SimTime::ZERO, slow);
        for _ in 0..1000 {
            turns.advance(slow);
        }
        assert_eq!(turns.next(), SimTime(20_112_000_000));
    }

    #[test]
    fn a_new_frequency_counts_from_the_turn_that_brought_it() {
        let mut turns = Turns::new(SimTime::ZERO, mirror(5000));
        turns.advance(mirror(5000));
        assert_eq!(turns.next(), SimTime(20_000_000));
        turns.advance(mirror(2500));
        assert_eq!(turns.next(), SimTime(60_000_000));
        turns.advance(mirror(2500));
        assert_eq!(turns.next(), SimTime(100_000_000));
    }
}
