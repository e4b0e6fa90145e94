//! The device's own clock: µs since power-up, with the drift and jitter of a real one.

use super::calendar;
use super::options::{Options, Profile};
use super::random::{Random, Stage};
use crate::telegram::DateTime;
use crate::time::SimTime;

/// Parts of one million.
const MILLION: i128 = 1_000_000;

/// Clock of one device.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clock {
    /// Simulated time of power-up, ns; negative if before time zero.
    power_up_ns: i64,
    /// Too fast by so many parts per million.
    ppm: i32,
    /// Largest deviation of a scan's time, µs.
    jitter_us: u32,
    random: Random,
    /// Calendar = power-up time + this, µs; wraps. Zero until LSPsetdatetime: the calendar starts at 1970 with power-up.
    calendar_offset_us: u64,
    /// What was set and what was gained so far, µs.
    ahead_us: i64,
    /// Too fast besides by so many parts per million, since an instant.
    drift: Option<(SimTime, f64)>,
}

impl Clock {
    pub(super) fn new(options: &Options, jitter_us: u32) -> Self {
        let before = i64::try_from(options.power_up_before.as_nanos()).unwrap_or(i64::MAX);
        let jitter_us = match options.profile {
            Profile::Bench => 0,
            Profile::Field => jitter_us,
        };
        Self {
            power_up_ns: -before,
            ppm: options.clock_ppm,
            jitter_us,
            random: Random::new(options.seed, options.scanner),
            calendar_offset_us: 0,
            ahead_us: 0,
            drift: None,
        }
    }

    /// The same crystal, powered up at `now`.
    pub(super) fn restarted(&self, now: SimTime) -> Self {
        let power_up_ns = i64::try_from(now.0).unwrap_or(i64::MAX);
        let drift = self.drift.map(|(_, ppm)| (now, ppm));
        Self { power_up_ns, calendar_offset_us: 0, ahead_us: 0, drift, ..*self }
    }

    pub(super) fn uptime_us(&self, now: SimTime) -> u64 {
        let ns = i128::from(now.0) - i128::from(self.power_up_ns);
        let own = (ns * (MILLION + i128::from(self.ppm)) / MILLION / 1000) as u64;
        own.wrapping_add_signed(self.ahead_us.wrapping_add(self.gained_us(now)))
    }

    /// What it has gained by its drift since that began, µs.
    fn gained_us(&self, now: SimTime) -> i64 {
        let Some((since, ppm)) = self.drift else { return 0 };
        (now.0.saturating_sub(since.0) as f64 * ppm / 1e9) as i64
    }

    /// From `now` on it runs so much faster besides; what it has gained so far stays.
    pub(super) fn drift(&mut self, now: SimTime, more_ppm: f64) {
        self.ahead_us = self.ahead_us.wrapping_add(self.gained_us(now));
        let ppm = self.drift.map_or(0.0, |(_, ppm)| ppm) + more_ppm;
        self.drift = Some((now, ppm));
    }

    /// Sets it forward, µs.
    pub(super) fn step(&mut self, us: i64) {
        self.ahead_us = self.ahead_us.wrapping_add(us);
    }

    /// Sets it forward so that its lower 32 bits are 0 at `at`.
    pub(super) fn wrap(&mut self, at: SimTime) {
        let low = self.uptime_us(at) as u32;
        // Back or forward, whichever is nearer; but not to before power-up.
        let nearest = -i64::from(low as i32);
        let is_before = self.ahead_us.wrapping_add(nearest) < 0;
        self.step(if is_before { nearest + (1 << 32) } else { nearest });
    }

    /// What a scan's time deviates by, µs: uniform, keyed by seed, scanner and turn.
    pub(super) fn jitter_us(&self, turn: u64) -> i64 {
        if self.jitter_us == 0 {
            return 0;
        }
        let width = 2 * u64::from(self.jitter_us) + 1;
        (self.random.bits(Stage::Jitter, turn) % width) as i64 - i64::from(self.jitter_us)
    }

    /// Sets the calendar at `now`; false for a date that does not exist.
    pub(super) fn set_date_time(&mut self, now: SimTime, date_time: &DateTime) -> bool {
        let Some(us) = calendar::microseconds(date_time) else { return false };
        self.calendar_offset_us = us.wrapping_sub(self.uptime_us(now));
        true
    }

    pub(super) fn date_time_at(&self, uptime_us: u64) -> DateTime {
        // A clock that was set back may read before 1970, where no calendar begins.
        let us = uptime_us.wrapping_add(self.calendar_offset_us);
        calendar::date_time(if us > u64::MAX / 2 { 0 } else { us })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns 0 to 3, 1000 and 1 000 000, µs: recorded before scanners had numbers.
    const JITTER_OF_SEED_7: [i64; 6] = [-37, 14, 47, -38, -32, 49];

    #[test]
    fn a_clock_a_hundred_ppm_fast_gains_six_milliseconds_a_minute() {
        let clock = Clock::new(&Options { clock_ppm: 100, ..Options::default() }, 50);
        assert_eq!(clock.uptime_us(SimTime(60_000_000_000)), 60_006_000);
        assert_eq!(clock.restarted(SimTime(59_000_000_000)).uptime_us(SimTime(60_000_000_000)), 1_000_100);
    }

    #[test]
    fn jitter_is_bounded_centred_and_repeats() {
        let options = Options { profile: Profile::Field, seed: 7, ..Options::default() };
        let clock = Clock::new(&options, 50);
        let jitter =
            |clock: &Clock| -> alloc::vec::Vec<i64> { (0..10_000).map(|n| clock.jitter_us(n)).collect() };
        let values = jitter(&clock);
        assert!(values.iter().all(|us| us.abs() <= 50));
        assert!(values.contains(&50) && values.contains(&-50));
        // Uniform over ±50: the mean of 10 000 has a standard deviation of 0.29.
        assert!(values.iter().sum::<i64>().abs() < 4 * 2_900);
        assert_eq!(values, jitter(&clock));
        assert_ne!(values, jitter(&Clock::new(&Options { seed: 8, ..options }, 50)));
        assert_ne!(values, jitter(&Clock::new(&Options { scanner: 1, ..options }, 50)));
    }

    #[test]
    fn the_first_scanner_has_the_jitter_of_its_seed() {
        let options = Options { profile: Profile::Field, seed: 7, ..Options::default() };
        let clock = Clock::new(&options, 50);
        assert_eq!([0, 1, 2, 3, 1000, 1_000_000].map(|turn| clock.jitter_us(turn)), JITTER_OF_SEED_7);
    }

    #[test]
    fn the_bench_profile_has_no_jitter() {
        assert_eq!(Clock::new(&Options::default(), 50).jitter_us(3), 0);
    }
}
