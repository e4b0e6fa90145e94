//! The device's own clock: µs since power-up, with the drift and jitter of a real one.

use super::calendar;
use super::options::{Options, Profile};
use super::random::{Random, Stage};
use crate::model::{Model, Scatter};
use crate::telegram::DateTime;
use crate::time::SimTime;

/// Parts of one million.
const MILLION: i128 = 1_000_000;

/// Clock of one device.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// Simulated time of power-up, ns; negative if before time zero.
    power_up_ns: i64,
    /// Too fast by so many parts per million.
    ppm: i32,
    /// How its scans' times scatter; none where they are exact.
    scatter: Option<Scattered>,
    /// From a scan's zero index to its transmission where that is exact, µs.
    transmit_delay_us: u32,
    random: Random,
    /// Calendar = power-up time + this, µs; wraps. Zero until LSPsetdatetime: the calendar starts at 1970 with power-up.
    calendar_offset_us: u64,
    /// What was set and what was gained so far, µs.
    ahead_us: i64,
    /// Too fast besides by so many parts per million, since an instant.
    drift: Option<(SimTime, f64)>,
}

/// The model's scatter, and its scale, which costs a root.
#[derive(Clone, Copy, Debug)]
struct Scattered {
    model: &'static Scatter,
    scale_us: f64,
}

impl Clock {
    pub(super) fn new(options: &Options, model: &'static Model) -> Self {
        let before = i64::try_from(options.power_up_before.as_nanos()).unwrap_or(i64::MAX);
        let scatter = match options.profile {
            Profile::Bench => None,
            Profile::Field => Some(Scattered { model: &model.scatter, scale_us: model.scatter.scale_us() }),
        };
        Self {
            power_up_ns: -before,
            ppm: options.clock_ppm,
            scatter,
            transmit_delay_us: model.transmit_delay_us,
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

    /// What a scan's time deviates by, µs: a sum over the last turns' random numbers, which are keyed by seed, scanner and turn. The turns
    /// before the first count as any other.
    pub(super) fn jitter_us(&self, turn: u64) -> i64 {
        let Some(Scattered { model, scale_us }) = self.scatter else { return 0 };
        let weighted = (0..)
            .zip(model.weights)
            .map(|(back, weight)| weight * self.random.two_sided(Stage::Period, turn.wrapping_sub(back)));
        libm::round(scale_us * weighted.sum::<f64>()) as i64
    }

    /// From a scan's zero index to its transmission, µs.
    pub(super) fn transmit_delay_us(&self, turn: u64) -> u32 {
        match self.scatter {
            None => self.transmit_delay_us,
            Some(Scattered { model, .. }) => model.delay_at_us(self.random.unit(Stage::Delay, turn)),
        }
    }

    /// Its random numbers, where times scatter.
    pub(super) fn random_if_scattered(&self) -> Option<Random> {
        self.scatter.map(|_| self.random)
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
    use crate::model::{MODELS, by_name};
    use alloc::vec::Vec;

    fn field(seed: u64, scanner: u32, model: &str) -> Clock {
        let options = Options { profile: Profile::Field, seed, scanner, ..Options::default() };
        Clock::new(&options, by_name(model).unwrap())
    }

    #[test]
    fn a_clock_a_hundred_ppm_fast_gains_six_milliseconds_a_minute() {
        let clock = Clock::new(&Options { clock_ppm: 100, ..Options::default() }, MODELS[0]);
        assert_eq!(clock.uptime_us(SimTime(60_000_000_000)), 60_006_000);
        assert_eq!(clock.restarted(SimTime(59_000_000_000)).uptime_us(SimTime(60_000_000_000)), 1_000_100);
    }

    /// Mean, standard deviation and the correlation of each value with the one before it.
    fn mean_sd_lag_1(values: &[f64]) -> (f64, f64, f64) {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let off: Vec<f64> = values.iter().map(|value| value - mean).collect();
        let variance = off.iter().map(|off| off * off).sum::<f64>() / count;
        let lagged = off.iter().zip(&off[1..]).map(|(a, b)| a * b).sum::<f64>() / count;
        (mean, libm::sqrt(variance), lagged / variance)
    }

    #[test]
    fn twenty_thousand_periods_scatter_and_follow_each_other_as_recorded() {
        for model in MODELS {
            let clock = field(7, 0, model.name);
            let stamps: Vec<f64> = (0..20_001).map(|turn| clock.jitter_us(turn) as f64).collect();
            let periods: Vec<f64> = stamps.iter().zip(&stamps[1..]).map(|(a, b)| b - a).collect();
            let (_, sd, lag_1) = mean_sd_lag_1(&periods);
            let told = model.name;
            assert!((sd / model.scatter.period_sd_us.value - 1.0).abs() < 0.05, "{told}: sd {sd}");
            assert!((lag_1 - model.scatter.lag_1.value).abs() < 0.05, "{told}: lag 1 {lag_1}");
            let within = model.scatter.period_within_us() + 1.0;
            assert!(periods.iter().all(|period| period.abs() <= within), "{told}");
            // The rate stays: a thousand periods are off by what two stamps are off, and not by the way of a random walk.
            let most = stamps.iter().fold(0.0, |most: f64, stamp| most.max(stamp.abs()));
            assert!(most < 6.0 * 7.5 * model.scatter.period_sd_us.value, "{told}: {most}");
        }
    }

    #[test]
    fn transmissions_are_as_late_as_recorded() {
        for model in MODELS {
            let clock = field(7, 0, model.name);
            let delays: Vec<u32> = (0..20_000).map(|turn| clock.transmit_delay_us(turn)).collect();
            let ends = [model.scatter.delay_us[0], model.scatter.delay_us[20]].map(u32::from);
            assert!(delays.iter().all(|delay| (ends[0]..=ends[1]).contains(delay)), "{}", model.name);
            let values: Vec<f64> = delays.iter().map(|delay| f64::from(*delay)).collect();
            let (mean, sd, lag_1) = mean_sd_lag_1(&values);
            let (wanted_mean, wanted_sd) = model.scatter.delay_mean_sd_us();
            assert!((mean - wanted_mean).abs() < 0.05 * wanted_sd, "{}: {mean}", model.name);
            assert!((sd / wanted_sd - 1.0).abs() < 0.05, "{}: {sd}", model.name);
            assert!(lag_1.abs() < 0.05, "{}: {lag_1}", model.name);
        }
    }

    #[test]
    fn the_same_seed_has_the_same_stamps_and_another_has_others() {
        let told = |clock: &Clock| -> Vec<(i64, u32)> {
            (0..100).map(|turn| (clock.jitter_us(turn), clock.transmit_delay_us(turn))).collect()
        };
        let first = told(&field(7, 0, "lms111"));
        assert_eq!(first, told(&field(7, 0, "lms111")));
        assert_ne!(first, told(&field(8, 0, "lms111")));
        assert_ne!(first, told(&field(7, 1, "lms111")));
    }

    #[test]
    fn the_bench_profile_is_exact() {
        let clock = Clock::new(&Options::default(), by_name("lms111").unwrap());
        assert_eq!((clock.jitter_us(3), clock.transmit_delay_us(3)), (0, 3_100));
    }
}
