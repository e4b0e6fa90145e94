//! Range statistics of the first echo, streaming.

use crate::estimate::RangeStatistics;
use crate::geometry::{Reading, reading};

/// Running sums over all beams.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ranges {
    statistics: RangeStatistics,
    sum_m: f64,
}

impl Ranges {
    pub(crate) fn add(&mut self, range_m: &[f64]) {
        let all = &mut self.statistics;
        for &range_m in range_m {
            match reading(range_m) {
                Reading::Miss => all.misses += 1,
                Reading::Invalid => all.invalid += 1,
                Reading::Return => {
                    all.returns += 1;
                    all.min_m = Some(all.min_m.map_or(range_m, |min_m| min_m.min(range_m)));
                    all.max_m = Some(all.max_m.map_or(range_m, |max_m| max_m.max(range_m)));
                    self.sum_m += range_m;
                }
            }
        }
    }

    pub(crate) fn statistics(&self) -> RangeStatistics {
        let mean_m = (self.statistics.returns > 0).then(|| self.sum_m / self.statistics.returns as f64);
        RangeStatistics { mean_m, ..self.statistics }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::scan::NO_ECHO;

    #[test]
    fn returns_misses_and_nonsense_are_told_apart() {
        let mut ranges = Ranges::default();
        assert_eq!(ranges.statistics(), RangeStatistics::default());
        ranges.add(&[2.0, NO_ECHO, 4.0, f64::NAN, -1.0]);
        ranges.add(&[NO_ECHO, 6.0]);
        let expected = RangeStatistics {
            returns: 3,
            misses: 2,
            invalid: 2,
            min_m: Some(2.0),
            max_m: Some(6.0),
            mean_m: Some(4.0),
        };
        assert_eq!(ranges.statistics(), expected);
    }
}
