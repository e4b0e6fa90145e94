//! Which organs a scan plane across the row may cut: extents along Y, sorted, in tiers of like length.

use std::ops::Range;

/// What an organ takes up along Y, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    pub(super) from_m: f64,
    pub(super) to_m: f64,
}

impl Extent {
    /// The smallest extent that holds all values.
    pub(super) fn around(values: impl Iterator<Item = f64>) -> Self {
        values.fold(Self { from_m: f64::INFINITY, to_m: f64::NEG_INFINITY }, |extent, y| Self {
            from_m: extent.from_m.min(y),
            to_m: extent.to_m.max(y),
        })
    }

    /// The shifts by whole periods that bring some of the extent into [0, period]: one for most organs, two for one that
    /// crosses the border, more for one longer than the row. Just 0 for a scene without period.
    pub(super) fn images(self, period_m: f64) -> impl Iterator<Item = f64> {
        let periods = if period_m.is_finite() && period_m > 0.0 {
            (-self.to_m / period_m).ceil() as i64..=((period_m - self.from_m) / period_m).floor() as i64
        } else {
            0..=0
        };
        periods.map(move |k| if k == 0 { 0.0 } else { k as f64 * period_m })
    }
}

/// Organs of like extent, sorted by where they begin.
#[derive(Clone, Debug, PartialEq)]
struct Tier {
    entries: Range<usize>,
    longest_m: f64,
}

/// Finds the organs at a place of the row by binary search. An extent is looked for no farther back than the longest of its
/// tier; tiers double in length, so one long organ does not widen the search for all.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RowIndex {
    from_m: Vec<f64>,
    to_m: Vec<f64>,
    tiers: Vec<Tier>,
}

impl RowIndex {
    /// Sorts the extents. Gives the index and, entry by entry, which extent it is.
    pub(super) fn new(extents: &[Extent]) -> (Self, Vec<usize>) {
        let tier_of = |extent: &Extent| {
            // The binary exponent of the length, a millimetre at least.
            (extent.to_m - extent.from_m).max(1e-3).to_bits() >> 52
        };
        let mut order: Vec<(u64, f64, usize)> = extents
            .iter()
            .enumerate()
            .map(|(number, extent)| (tier_of(extent), extent.from_m, number))
            .collect();
        order.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        let sorted = || order.iter().filter_map(|&(_, _, number)| extents.get(number));
        let mut tiers = Vec::new();
        let mut start = 0;
        for run in order.chunk_by(|a, b| a.0 == b.0) {
            let members = run.iter().filter_map(|&(_, _, number)| extents.get(number));
            let longest_m = members.map(|extent| extent.to_m - extent.from_m).fold(0.0, f64::max);
            tiers.push(Tier { entries: start..start + run.len(), longest_m });
            start += run.len();
        }
        let index = Self {
            from_m: sorted().map(|extent| extent.from_m).collect(),
            to_m: sorted().map(|extent| extent.to_m).collect(),
            tiers,
        };
        (index, order.into_iter().map(|(_, _, number)| number).collect())
    }

    /// The entries whose extent holds `y_m`.
    pub(super) fn at(&self, y_m: f64) -> impl Iterator<Item = usize> + '_ {
        self.tiers.iter().flat_map(move |tier| {
            let from_m = self.from_m.get(tier.entries.clone()).unwrap_or(&[]);
            // A hair farther back: from + length may round below to.
            let first = from_m.partition_point(|from| *from < y_m - tier.longest_m * (1.0 + 1e-9) - 1e-9);
            let last = from_m.partition_point(|from| *from <= y_m);
            let window = tier.entries.start + first..tier.entries.start + last;
            let to_m = self.to_m.get(window.clone()).unwrap_or(&[]);
            window.zip(to_m).filter_map(move |(entry, to)| (*to >= y_m).then_some(entry))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_index_finds_what_a_search_of_all_finds(
            spans in prop::collection::vec((-5.0..25.0f64, 0.0..3.0f64, 0..4), 0..80), y in -6.0..26.0f64,
        ) {
            let extents: Vec<Extent> = spans
                .iter()
                .map(|&(from_m, length, scale)| Extent { from_m, to_m: from_m + length * 0.1f64.powi(scale) })
                .collect();
            let (index, order) = RowIndex::new(&extents);
            let mut found: Vec<usize> = index.at(y).map(|entry| order[entry]).collect();
            found.sort_unstable();
            let all: Vec<usize> =
                (0..extents.len()).filter(|i| extents[*i].from_m <= y && y <= extents[*i].to_m).collect();
            prop_assert_eq!(found, all);
        }

        #[test]
        fn images_are_exactly_those_that_reach_into_the_period(
            from_m in -30.0..30.0f64, length in 0.0..12.0f64, period in 0.5..10.0f64,
        ) {
            let extent = Extent { from_m, to_m: from_m + length };
            let images: Vec<f64> = extent.images(period).collect();
            for k in -100..=100 {
                let shift = f64::from(k) * period;
                let reaches = extent.to_m + shift > 1e-9 && extent.from_m + shift < period - 1e-9;
                prop_assert!(!reaches || images.iter().any(|image| (image - shift).abs() < 1e-9));
            }
        }
    }
}
