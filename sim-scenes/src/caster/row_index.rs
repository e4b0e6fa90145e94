//! Which organs a scan plane across the row may cut: extents along Y, sorted, in tiers of like length.

use std::ops::Range;

use super::lanes::WIDTH;

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
    steps: Steps,
}

/// A table that a place is looked up in, where a search would go through the whole row: entries before each of evenly spaced places.
#[derive(Clone, Debug, PartialEq)]
struct Steps {
    first_m: f64,
    per_m: f64,
    before: Vec<u32>,
}

/// Entries to a step, more or less.
const TO_A_STEP: usize = 4;

impl Steps {
    fn new(from_m: &[f64]) -> Self {
        let (first_m, last_m) =
            (from_m.first().copied().unwrap_or(0.0), from_m.last().copied().unwrap_or(0.0));
        let count = from_m.len() / TO_A_STEP + 1;
        // A tier that begins in one place has one step.
        let per_m = count as f64 / (last_m - first_m).max(f64::MIN_POSITIVE);
        let per_m = if per_m.is_finite() { per_m } else { 0.0 };
        let mut steps = Self { first_m, per_m, before: Vec::with_capacity(count + 2) };
        for (number, from_m) in (0..).zip(from_m) {
            let step = steps.step_of(*from_m);
            while steps.before.len() <= step {
                steps.before.push(number);
            }
        }
        steps
    }

    fn step_of(&self, y_m: f64) -> usize {
        ((y_m - self.first_m) * self.per_m) as usize
    }

    /// How many of `from_m` (those the table is of) come before `y_m`, as `is_before` has it.
    fn before(&self, from_m: &[f64], y_m: f64, is_before: impl Fn(f64) -> bool) -> usize {
        // Entries of earlier steps are before it, and there is none of a step past the last.
        let Some(known) = self.before.get(self.step_of(y_m)) else { return from_m.len() };
        let known = *known as usize;
        let rest = from_m.get(known..).unwrap_or(&[]);
        known + rest.iter().take_while(|from_m| is_before(**from_m)).count()
    }
}

/// Finds the organs at a place of the row by a table. An extent is looked for no farther back than the longest of its
/// tier; tiers double in length, so one long organ does not widen the search for all. Entries come in rows of [`WIDTH`]; every
/// tier begins a new row.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RowIndex {
    from_m: Vec<f64>,
    tiers: Vec<Tier>,
}

/// Extents shorter than this share a tier.
const SHORTEST_M: f64 = 1e-2;

impl RowIndex {
    /// Sorts the extents. Gives the index and, entry by entry, which extent it is; None fills up a row.
    pub(super) fn new(extents: &[Extent]) -> (Self, Vec<Option<usize>>) {
        let tier_of = |extent: &Extent| {
            // The binary exponent of the length and the first bit after it: tiers grow by halves.
            (extent.to_m - extent.from_m).max(SHORTEST_M).to_bits() >> 51
        };
        let mut order: Vec<(u64, f64, usize)> = extents
            .iter()
            .enumerate()
            .map(|(number, extent)| (tier_of(extent), extent.from_m, number))
            .collect();
        order.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut index = Self::default();
        let mut numbers = Vec::with_capacity(extents.len() + WIDTH);
        for run in order.chunk_by(|a, b| a.0 == b.0) {
            let start = numbers.len();
            let members = run.iter().filter_map(|&(_, _, number)| extents.get(number));
            let longest_m = members.map(|extent| extent.to_m - extent.from_m).fold(0.0, f64::max);
            index.from_m.extend(run.iter().map(|&(_, from_m, _)| from_m));
            numbers.extend(run.iter().map(|&(_, _, number)| Some(number)));
            let steps = Steps::new(index.from_m.get(start..).unwrap_or(&[]));
            index.tiers.push(Tier { entries: start..numbers.len(), longest_m, steps });
            let full = numbers.len().next_multiple_of(WIDTH);
            index.from_m.resize(full, f64::INFINITY);
            numbers.resize(full, None);
        }
        (index, numbers)
    }

    /// Rows of entries, of which no other may hold any extent that touches [low, high].
    pub(super) fn rows(&self, low_m: f64, high_m: f64) -> impl Iterator<Item = Range<usize>> + '_ {
        self.tiers.iter().map(move |tier| {
            let from_m = self.from_m.get(tier.entries.clone()).unwrap_or(&[]);
            // A hair farther back: from + length may round below to.
            let low_m = low_m - tier.longest_m * (1.0 + 1e-9) - 1e-9;
            let first = tier.steps.before(from_m, low_m, |from| from < low_m);
            let last = tier.steps.before(from_m, high_m, |from| from <= high_m);
            let row = tier.entries.start / WIDTH;
            if first < last { row + first / WIDTH..row + last.div_ceil(WIDTH) } else { row..row }
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
            spans in prop::collection::vec((-5.0..25.0f64, 0.0..3.0f64, 0..4), 0..80),
            y in -6.0..26.0f64, more in 0.0..2.0f64,
        ) {
            let extents: Vec<Extent> = spans
                .iter()
                .map(|&(from_m, length, scale)| Extent { from_m, to_m: from_m + length * 0.1f64.powi(scale) })
                .collect();
            let (index, order) = RowIndex::new(&extents);
            let entries = index.rows(y, y + more).flatten().flat_map(|row| row * WIDTH..(row + 1) * WIDTH);
            let touches = |i: &usize| extents[*i].from_m <= y + more && y <= extents[*i].to_m;
            let mut found: Vec<usize> = entries.filter_map(|entry| order[entry]).filter(touches).collect();
            found.sort_unstable();
            let all: Vec<usize> = (0..extents.len()).filter(touches).collect();
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
