//! How far the wheel had turned when a scan began, by telegrams of the encoder of their own.

use crate::reading::WheelReading;
use crate::scan::EncoderReading;

/// A reading farther from a scan's start says nothing of it, µs.
const NEAR_US: i32 = 200_000;

/// One reading alone stands for scans that are no farther from it, µs: a turn at 20 Hz.
const ALONE_US: i32 = 50_000;

/// The latest readings of the encoder.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wheel {
    before: Option<WheelReading>,
    last: Option<WheelReading>,
}

impl Wheel {
    /// The next one. One that came twice, or behind a later one, tells nothing new; a clock that has gone farther back is another one.
    pub(super) fn take(&mut self, reading: WheelReading) {
        let behind_us = self.last.and_then(|last| last.time_us.checked_sub(reading.time_us));
        if behind_us.is_some_and(|behind_us| behind_us <= u64::from(NEAR_US.unsigned_abs())) {
            return;
        }
        self.before = self.last.filter(|last| last.time_us < reading.time_us);
        self.last = Some(reading);
    }

    /// What the encoder had counted at `time_us` on the scanner's clock, of 32 bits: on a straight line through the two readings. `None` where no reading is near.
    pub(super) fn at(&self, time_us: u32) -> Option<EncoderReading> {
        let last = self.last?;
        let since_us = time_us.wrapping_sub(last.time_us as u32).cast_signed();
        if since_us.checked_abs().is_none_or(|away| away > NEAR_US) {
            return None;
        }
        let ticks = match self.before {
            Some(before) => {
                let counted = f64::from(last.tick.wrapping_sub(before.tick).cast_signed());
                counted * f64::from(since_us) / (last.time_us - before.time_us) as f64
            }
            // Nothing tells how fast it turns.
            None if since_us.abs() <= ALONE_US => 0.0,
            None => return None,
        };
        let position_ticks = last.tick.wrapping_add((libm::round(ticks) as i32).cast_unsigned());
        // Only its ticks are told.
        Some(EncoderReading { position_ticks, speed: 0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wheel(readings: &[(u64, u32)]) -> Wheel {
        let mut wheel = Wheel::default();
        readings.iter().for_each(|(time_us, tick)| {
            wheel.take(WheelReading { time_us: *time_us, tick: *tick, speed: 0.0 });
        });
        wheel
    }

    fn ticks(wheel: &Wheel, time_us: u32) -> Option<u32> {
        wheel.at(time_us).map(|reading| reading.position_ticks)
    }

    #[test]
    fn a_scan_has_the_ticks_of_its_own_start() {
        let wheel = wheel(&[(1_000_000, 500), (1_020_000, 530)]);
        assert_eq!(ticks(&wheel, 1_020_000), Some(530));
        assert_eq!(ticks(&wheel, 1_010_000), Some(515), "between two readings");
        assert_eq!(ticks(&wheel, 1_030_000), Some(545), "a reading is on its way");
        assert_eq!(ticks(&wheel, 1_300_000), None, "no reading has come for long");
    }

    #[test]
    fn counters_and_clocks_wrap_and_clocks_begin_anew() {
        let at = (1 << 32) - 10_000;
        let wrapping = wheel(&[(at, u32::MAX - 9), (at + 20_000, 20)]);
        assert_eq!(ticks(&wrapping, 10_000), Some(20));
        assert_eq!(ticks(&wrapping, 0), Some(5));
        // Backwards.
        let back = wheel(&[(1_000_000, 20), (1_020_000, 10)]);
        assert_eq!(ticks(&back, 1_040_000), Some(0));
        // Twice, or late: as if it had come once, in its place.
        for came in [
            &[(1_000_000, 500), (1_020_000, 530), (1_020_000, 530)][..],
            &[(1_000_000, 500), (1_020_000, 530), (1_010_000, 515)],
        ] {
            let wheel = self::wheel(came);
            assert_eq!(
                (ticks(&wheel, 1_020_000), ticks(&wheel, 1_060_000)),
                (Some(530), Some(590)),
                "{came:?}"
            );
        }
        // After a restart one reading tells of its own instant only.
        let anew = wheel(&[(9_000_000, 700), (9_020_000, 720), (15_000, 0)]);
        assert_eq!((ticks(&anew, 15_000), ticks(&anew, 90_000)), (Some(0), None));
    }
}
