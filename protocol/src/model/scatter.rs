//! How a real mirror's periods and its scans' times of transmission scatter (`field` profile).

use crate::optics::Fact;

/// Scatter of the recorded time stamps. A period here is the time from one scan's zero index to the next one's, on the device's own clock.
///
/// A stamp is off its even place by a weighted sum of random numbers, one a turn. So the periods vary with the recorded standard deviation, follow
/// each other as recorded, and the rate stays the mean for ever.
#[derive(Debug)]
pub struct Scatter {
    /// Standard deviation of the period, µs.
    pub period_sd_us: Fact,
    /// Correlation of a period with the one before it.
    pub lag_1: Fact,
    /// Correlation of a period with the one before that.
    pub lag_2: Fact,
    /// How much the random numbers of this turn, of the one before it and so on count in a stamp's deviation; to any scale. Chosen so that the periods
    /// have the two correlations.
    pub weights: &'static [f64],
    /// Time from the zero index to the transmission, µs: every twentieth of its recorded distribution, from the smallest value to the largest.
    pub delay_us: [u16; 21],
}

impl Scatter {
    /// What the weights add to a period: their differences, turn by turn.
    fn differences(&self) -> impl Iterator<Item = f64> + '_ {
        let before = core::iter::once(0.0).chain(self.weights.iter().copied());
        let after = self.weights.iter().copied().chain(core::iter::once(0.0));
        after.zip(before).map(|(after, before)| after - before)
    }

    /// µs a unit of weight, for random numbers whose variance is 1/2.
    pub(crate) fn scale_us(&self) -> f64 {
        let squares: f64 = self.differences().map(|difference| difference * difference).sum();
        self.period_sd_us.value * libm::sqrt(2.0 / squares)
    }

    /// How far a period can be off its mean, µs: all random numbers at their largest.
    pub fn period_within_us(&self) -> f64 {
        self.scale_us() * self.differences().map(libm::fabs).sum::<f64>()
    }

    /// Mean and standard deviation of the time from the zero index to the transmission, µs, between its recorded twentieths a straight line.
    pub fn delay_mean_sd_us(&self) -> (f64, f64) {
        let pieces = || self.delay_us.iter().zip(self.delay_us.iter().skip(1));
        let count = pieces().count() as f64;
        let ends = |(&low, &high): (&u16, &u16)| (f64::from(low), f64::from(high));
        let mean = pieces().map(ends).map(|(low, high)| (low + high) / 2.0).sum::<f64>() / count;
        let square = |(low, high): (f64, f64)| {
            let (low, high) = (low - mean, high - mean);
            (low * low + low * high + high * high) / 3.0
        };
        let variance = pieces().map(ends).map(square).sum::<f64>() / count;
        (mean, libm::sqrt(variance))
    }

    /// The time from the zero index to the transmission that stands at `share` (0 to 1) of the distribution, µs.
    pub(crate) fn delay_at_us(&self, share: f64) -> u32 {
        let place = share * (self.delay_us.len() - 1) as f64;
        let piece = place as usize;
        match self.delay_us.get(piece..) {
            Some(&[low, high, ..]) => {
                let (low, high) = (f64::from(low), f64::from(high));
                libm::round(low + (high - low) * (place - piece as f64)) as u32
            }
            Some(&[last]) => last.into(),
            _ => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use crate::model::MODELS;

    #[test]
    fn the_weights_have_the_recorded_correlations() {
        for model in MODELS {
            let scatter = &model.scatter;
            let differences: Vec<f64> = scatter.differences().collect();
            let product = |lag: usize| -> f64 {
                differences.iter().zip(differences.iter().skip(lag)).map(|(a, b)| a * b).sum()
            };
            for (lag, fact) in [(1, scatter.lag_1), (2, scatter.lag_2)] {
                let found = product(lag) / product(0);
                assert!(
                    (found - fact.value).abs() < 0.06,
                    "{}: lag {lag} is {found}, not {fact}",
                    model.name
                );
            }
            // The rate stays: what a random number adds to some periods it takes from others.
            assert!(differences.iter().sum::<f64>().abs() < 1e-9);
        }
    }

    #[test]
    fn delays_reach_from_the_least_to_the_greatest() {
        for model in MODELS {
            let scatter = &model.scatter;
            assert!(scatter.delay_us.is_sorted());
            let ends = [scatter.delay_us[0], scatter.delay_us[20]].map(u32::from);
            assert_eq!([0.0, 1.0].map(|share| scatter.delay_at_us(share)), ends);
        }
    }
}
