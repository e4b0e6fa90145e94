//! Echoes as the peaks of what a receiver hears: every return is a pulse of one shape, and pulses that overlap add up.
//!
//! One return alone is a peak at its own range. Of two returns, the peaks melt together where they are closer than about 0.85 pulse widths.

use super::touch::{Echo, Touch};

/// From the width of a Gaussian pulse at half its height to its standard deviation.
const SIGMAS_A_WIDTH: f64 = 2.354_820_045_030_949;

/// Beyond so many standard deviations a pulse adds nothing.
const REACH: f64 = 5.0;

/// Looks a standard deviation: peaks are told apart that the sum has a valley between.
const LOOKS: f64 = 8.0;

/// A peak is found when a step moves it less than this, metres.
const SETTLED_M: f64 = 1e-7;

/// Steps towards a peak at most: it is nearly found when they begin.
const MOST_STEPS: usize = 60;

/// A receiver of Gaussian pulses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waveform {
    sigma_m: f64,
}

impl Waveform {
    /// For pulses as wide as `width_m` at half their height, metres of range.
    pub(super) const fn new(width_m: f64) -> Self {
        Self { sigma_m: width_m / SIGMAS_A_WIDTH }
    }

    /// The peaks of what a beam met, nearest first. Sorts `touches` by range.
    pub(super) fn echoes(&self, touches: &mut Vec<Touch>, echoes: &mut Vec<Echo>) {
        echoes.clear();
        touches.retain(|touch| touch.power > 0.0);
        touches.sort_by(|one, other| one.range_m.total_cmp(&other.range_m));
        for heard in touches.chunk_by(|near, far| far.range_m - near.range_m <= REACH * self.sigma_m) {
            self.peaks(heard, echoes);
        }
    }

    /// The peaks of returns that overlap.
    fn peaks(&self, heard: &[Touch], echoes: &mut Vec<Echo>) {
        let [Some(first), Some(last)] = [heard.first(), heard.last()] else { return };
        let step_m = self.sigma_m / LOOKS;
        let looks = ((last.range_m - first.range_m) / step_m).ceil() as usize;
        let at = |look: usize| first.range_m + look as f64 * step_m;
        let (mut from, mut highest, mut falls) = (0, (first.range_m, 0.0), false);
        let mut before = 0.0;
        for look in 0..=looks {
            let range_m = at(look).min(last.range_m);
            let height = self.height(heard, range_m);
            let rises = height > before;
            if falls && rises {
                // The valley behind a peak: what lies up to here is that peak's.
                from = self.peak(heard, from, at(look - 1), highest.0, echoes);
                highest = (range_m, height);
            }
            falls = !rises;
            if height > highest.1 {
                highest = (range_m, height);
            }
            before = height;
        }
        self.peak(heard, from, f64::INFINITY, highest.0, echoes);
    }

    /// Adds the peak near `near_m`, with the returns from number `from` up to `to_m`; the number of the first return behind them.
    fn peak(&self, heard: &[Touch], from: usize, to_m: f64, near_m: f64, echoes: &mut Vec<Echo>) -> usize {
        let own = heard.get(from..).unwrap_or_default();
        let own = own.iter().take_while(|touch| touch.range_m <= to_m);
        let (mut power, mut share, mut first, mut second, mut count) = (0.0, 0.0, 0.0, 0.0, 0);
        let mut strongest: Option<&Touch> = None;
        for touch in own {
            let off_m = touch.range_m - near_m;
            (power, share, count) = (power + touch.power, share + touch.share, count + 1);
            (first, second) = (first + touch.power * off_m, second + touch.power * off_m * off_m);
            if strongest.is_none_or(|strongest| touch.power > strongest.power) {
                strongest = Some(touch);
            }
        }
        if let Some(strongest) = strongest {
            echoes.push(Echo {
                range_m: self.top(heard, near_m),
                power,
                share,
                spread_m: Echo::spread_m(power, first, second),
                ray: strongest.ray,
            });
        }
        from + count
    }

    /// The top of the peak near `near_m`: to the mean of what is heard there, again and again, leads uphill.
    fn top(&self, heard: &[Touch], near_m: f64) -> f64 {
        let mut top_m = near_m;
        for _ in 0..MOST_STEPS {
            let (mut sum, mut moment) = (0.0, 0.0);
            for touch in heard {
                let loudness = touch.power * self.pulse(touch.range_m - top_m);
                (sum, moment) = (sum + loudness, moment + loudness * (touch.range_m - top_m));
            }
            let by_m = if sum > 0.0 { moment / sum } else { 0.0 };
            top_m += by_m;
            if by_m.abs() < SETTLED_M {
                break;
            }
        }
        top_m
    }

    fn height(&self, heard: &[Touch], range_m: f64) -> f64 {
        heard.iter().map(|touch| touch.power * self.pulse(touch.range_m - range_m)).sum()
    }

    /// A pulse `off_m` from its middle, relative to its height.
    fn pulse(&self, off_m: f64) -> f64 {
        let off = off_m / self.sigma_m;
        if off.abs() > REACH { 0.0 } else { (-0.5 * off * off).exp() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH_M: f64 = 0.75;

    fn echoes(returns: &[(f64, f64)]) -> Vec<Echo> {
        let touch = |(ray, (range_m, power)): (usize, &(f64, f64))| Touch {
            range_m: *range_m,
            share: *power,
            power: *power,
            ray: ray as u32,
        };
        let (mut touches, mut found) = (returns.iter().enumerate().map(touch).collect(), Vec::new());
        Waveform::new(WIDTH_M).echoes(&mut touches, &mut found);
        found
    }

    #[test]
    fn a_single_return_is_measured_where_it_is() {
        for range_m in [0.5, 2.0, 7.321] {
            let [echo] = echoes(&[(range_m, 0.3)])[..] else { panic!("one echo") };
            assert!((echo.range_m - range_m).abs() < 1e-9 && echo.power == 0.3 && echo.spread_m == 0.0);
        }
    }

    #[test]
    fn equal_returns_are_one_peak_between_them_until_there_is_a_valley() {
        // Two equal Gaussians have a valley where they are more than two standard deviations apart.
        let valley_m = 2.0 * WIDTH_M / SIGMAS_A_WIDTH;
        let [one] = echoes(&[(2.0, 0.5), (2.0 + 0.95 * valley_m, 0.5)])[..] else { panic!("one echo") };
        assert!((one.range_m - (2.0 + 0.475 * valley_m)).abs() < 1e-3, "{one:?}");
        assert!((one.power - 1.0).abs() < 1e-12);
        let [near, far] = echoes(&[(2.0, 0.5), (2.0 + 1.3 * valley_m, 0.5)])[..] else { panic!("two") };
        assert!(near.range_m > 2.0 && far.range_m < 2.0 + 1.3 * valley_m, "drawn together");
        assert!((near.power, far.power, near.ray, far.ray) == (0.5, 0.5, 0, 1));
        // Far apart, either is where it is.
        let [near, far] = echoes(&[(2.0, 0.5), (4.0, 0.1)])[..] else { panic!("two") };
        assert!((near.range_m - 2.0).abs() < 1e-6 && (far.range_m - 4.0).abs() < 1e-6);
    }

    #[test]
    fn a_weak_return_on_a_strong_ones_flank_draws_it_less_than_the_mean_of_both() {
        let [echo] = echoes(&[(2.0, 0.9), (2.5, 0.1)])[..] else { panic!("one echo") };
        let mean_m = 0.9 * 2.0 + 0.1 * 2.5;
        assert!(2.0 < echo.range_m && echo.range_m < mean_m, "{} {mean_m}", echo.range_m);
    }

    /// No return is lost or counted twice, and the order of what was met does not matter.
    #[test]
    fn all_power_is_in_some_peak() {
        let mut draw = 0x9e37_79b9_7f4a_7c15_u64;
        let mut next = || {
            draw = draw.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (draw >> 11) as f64 / (1_u64 << 53) as f64
        };
        for number in 1..200 {
            let returns: Vec<_> = (0..number % 40 + 1).map(|_| (1.0 + 8.0 * next(), 0.01 + next())).collect();
            let found = echoes(&returns);
            let all: f64 = returns.iter().map(|(_, power)| power).sum();
            let told: f64 = found.iter().map(|echo| echo.power).sum();
            assert!((all - told).abs() < 1e-9, "{all} {told}");
            assert!(found.windows(2).all(|pair| pair[0].range_m < pair[1].range_m), "{found:?}");
            let backwards: Vec<_> = returns.iter().rev().copied().collect();
            let ranges = |found: &[Echo]| found.iter().map(|echo| echo.range_m).collect::<Vec<_>>();
            assert_eq!(ranges(&found), ranges(&echoes(&backwards)));
        }
    }
}
