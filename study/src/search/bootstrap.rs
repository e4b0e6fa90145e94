//! Intervals of what is told of many seeds: percentile bootstrap over the seeds (Efron 1979).
//!
//! Seeds are drawn with replacement, as many as there are, and the statistic (a median, or what follows from six of them) is taken anew; the
//! middle 95 % of [`DRAWS`] such values are the interval. It says how far another set of as many seeds may lead, and nothing of what is wrong with all.

use rowscan_protocol::random::Stream;

/// How often the seeds are drawn.
pub(crate) const DRAWS: usize = 2000;
/// First word of the streams' keys.
const PURPOSE: u64 = 0x626f_6f74;

/// Seeds drawn with replacement: the same draws for every statistic of a point.
#[derive(Clone, Debug)]
pub(super) struct Draws(Vec<Vec<usize>>);

impl Draws {
    /// Draws of `n` seeds; keyed, so that they repeat.
    pub(super) fn new(seed: u64, point: usize, n: usize) -> Self {
        let mut stream = Stream::keyed(seed, &[PURPOSE, point as u64]);
        let mut one = || (0..n).map(|_| (stream.unit() * n as f64) as usize).collect();
        Self((0..DRAWS).map(|_| one()).collect())
    }

    /// The middle 95 % of a statistic; None where a draw has no value.
    pub(super) fn interval(&self, statistic: impl Fn(&[usize]) -> Option<f64>) -> Option<[f64; 2]> {
        let mut values: Vec<f64> = self.0.iter().map(|draw| statistic(draw)).collect::<Option<_>>()?;
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| values.get((share * (values.len() as f64 - 1.0)).round() as usize).copied();
        Some([at(0.025)?, at(0.975)?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::median;

    fn of_median(values: &[f64], draws: &Draws) -> [f64; 2] {
        let drawn =
            |draw: &[usize]| median(draw.iter().filter_map(|seed| values.get(*seed).copied()).collect());
        draws.interval(drawn).expect("an interval")
    }

    #[test]
    fn an_interval_of_the_median_holds_it_about_as_often_as_it_says() {
        // Fifteen exponential numbers, whose median is ln 2; an undercovering of a few points is the bootstrap's.
        let held = (0..400).filter(|trial| {
            let mut stream = Stream::keyed(*trial, &[1]);
            let values: Vec<f64> = (0..15).map(|_| -(1.0 - stream.unit()).ln()).collect();
            let [low, high] = of_median(&values, &Draws::new(*trial, 0, values.len()));
            (low..=high).contains(&std::f64::consts::LN_2)
        });
        let held = held.count();
        assert!((356..=396).contains(&held), "{held} of 400");
    }

    #[test]
    fn what_does_not_vary_has_an_interval_of_no_width_and_draws_repeat() {
        assert_eq!(of_median(&[2.5; 10], &Draws::new(7, 3, 10)), [2.5, 2.5]);
        assert_eq!(Draws::new(7, 3, 10).0, Draws::new(7, 3, 10).0);
        assert_ne!(Draws::new(7, 3, 10).0, Draws::new(7, 4, 10).0);
        assert_eq!(Draws::new(7, 3, 10).interval(|_| None), None);
    }
}
