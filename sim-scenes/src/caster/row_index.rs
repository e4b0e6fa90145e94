//! Which organs a scan plane across the row may cut: organs in eights of like extent along Y, and for every short stretch of the row the
//! eights that reach into it.

use rayon::prelude::*;

use crate::lanes::WIDTH;

/// What an organ takes up along Y, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct YExtent {
    pub(super) from_m: f64,
    pub(super) to_m: f64,
}

/// How far so many periods are: nothing for none, however long one is.
pub(super) fn shift_m(periods: i64, period_m: f64) -> f64 {
    if periods == 0 { 0.0 } else { periods as f64 * period_m }
}

impl YExtent {
    /// The smallest extent that holds all values.
    pub(super) fn around(values: impl Iterator<Item = f64>) -> Self {
        values.fold(Self { from_m: f64::INFINITY, to_m: f64::NEG_INFINITY }, |extent, y| Self {
            from_m: extent.from_m.min(y),
            to_m: extent.to_m.max(y),
        })
    }

    /// The extent so far along the row.
    pub(super) fn moved(self, shift_m: f64) -> Self {
        Self { from_m: self.from_m + shift_m, to_m: self.to_m + shift_m }
    }

    fn length_m(self) -> f64 {
        self.to_m - self.from_m
    }

    fn middle_m(self) -> f64 {
        (self.from_m + self.to_m) / 2.0
    }

    /// The smallest extent that holds all extents.
    fn joined(extents: impl Iterator<Item = Self>) -> Self {
        Self::around(extents.flat_map(|extent| [extent.from_m, extent.to_m]))
    }

    /// The shifts that bring some of the extent into [0, period], as [`Self::periods`] has them.
    pub(super) fn images(self, period_m: f64) -> impl Iterator<Item = f64> {
        self.periods(period_m).map(move |periods| shift_m(periods, period_m))
    }

    /// The shifts, in whole periods, that bring some of the extent into [0, period]: one for most organs, two for one that crosses the border,
    /// more for one longer than the row. Just 0 for a scene without period.
    pub(super) fn periods(self, period_m: f64) -> impl Iterator<Item = i64> {
        if period_m.is_finite() && period_m > 0.0 {
            (-self.to_m / period_m).ceil() as i64..=((period_m - self.from_m) / period_m).floor() as i64
        } else {
            0..=0
        }
    }
}

/// Finds the eights at a place of the row: one look into a table, however long the row.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RowIndex {
    first_m: f64,
    stretches_per_m: f64,
    stretches: Vec<Stretch>,
    /// The eights of every stretch in turn.
    eights: Vec<u32>,
}

/// A short stretch of the row: where its eights are listed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Stretch {
    /// Those that began in earlier stretches.
    start: u32,
    /// Those that begin here.
    begun: u32,
    end: u32,
}

/// Eights that are packed together.
const RUN: usize = 32;

/// Extents, sorted by their middles, in the order in which a line comes upon the fewest eights of them. Eights of neighbours are short if
/// neighbours are of like length; where they are not, neighbours a little farther on are sorted by length first. How far, is tried.
fn packed(run: &[u32], extent: impl Fn(&u32) -> YExtent) -> Vec<u32> {
    let farther = (0..).map(|power| 1 << power).take_while(|eights| *eights <= RUN);
    let ways = farther.map(|eights| {
        let mut way = run.to_vec();
        for slab in way.chunks_mut(WIDTH * eights) {
            slab.sort_by(|a, b| extent(a).length_m().total_cmp(&extent(b).length_m()));
        }
        let reaches = way.chunks(WIDTH).map(|eight| YExtent::joined(eight.iter().map(&extent)).length_m());
        let reach_m: f64 = reaches.sum();
        (reach_m, way)
    });
    ways.min_by(|a, b| a.0.total_cmp(&b.0)).map_or_else(Vec::new, |(_, way)| way)
}

/// Stretches that an eight reaches into, on average: more find fewer eights in vain, and take more memory.
const REACHED: f64 = 16.0;

/// Most stretches, as a multiple of the eights.
const MOST: f64 = 16.0;

impl RowIndex {
    /// Sorts the extents into eights. Gives the index and, entry by entry, which extent it is; what fills up an eight is beyond them all.
    pub(super) fn new(extents: &[YExtent]) -> (Self, Vec<u32>) {
        let extent = |number: &u32| {
            extents.get(*number as usize).copied().unwrap_or(YExtent { from_m: 0.0, to_m: 0.0 })
        };
        // Eights are listed as numbers of 32 bits too: more extents than that no machine holds.
        let mut order: Vec<u32> = (0..extents.len() as u32).collect();
        order.par_sort_by(|a, b| extent(a).middle_m().total_cmp(&extent(b).middle_m()));
        let mut numbers = Vec::with_capacity(extents.len() + WIDTH);
        let mut reaches = Vec::with_capacity(extents.len() / WIDTH + 1);
        let runs: Vec<Vec<u32>> = order.par_chunks(WIDTH * RUN).map(|run| packed(run, extent)).collect();
        drop(order);
        for run in runs {
            for eight in run.chunks(WIDTH) {
                reaches.push(YExtent::joined(eight.iter().map(extent)));
                numbers.extend(eight);
                numbers.resize(numbers.len().next_multiple_of(WIDTH), u32::MAX);
            }
        }
        (Self::over(&reaches), numbers)
    }

    /// Lists the eights in the stretches they reach into.
    fn over(eights: &[YExtent]) -> Self {
        let whole = YExtent::joined(eights.iter().copied());
        let length_m = whole.length_m();
        if !length_m.is_finite() {
            return Self::default();
        }
        let count = eights.len() as f64;
        let mean_m = eights.iter().map(|eight| eight.length_m()).sum::<f64>() / count;
        let stretches = (REACHED * length_m / mean_m).min(MOST * count).max(1.0).ceil();
        // A row that begins and ends in one place is one stretch.
        let per_m = if length_m > 0.0 { stretches / length_m } else { 0.0 };
        let stretches_per_m = if per_m.is_finite() { per_m } else { 0.0 };
        let mut index = Self {
            first_m: whole.from_m,
            stretches_per_m,
            stretches: vec![Stretch::default(); stretches as usize + 1],
            eights: vec![],
        };
        // How many are listed, then where, then which.
        for eight in eights {
            let first = index.stretch(eight.from_m);
            for stretch in first..=index.stretch(eight.to_m) {
                if let Some(stretch_of) = index.stretches.get_mut(stretch) {
                    stretch_of.end += 1;
                    stretch_of.begun += u32::from(stretch > first);
                }
            }
        }
        let mut sum = 0;
        for stretch in &mut index.stretches {
            let (all, begun) = (stretch.end, stretch.begun);
            *stretch = Stretch { start: sum, begun: sum + begun, end: sum + begun };
            sum += all;
        }
        index.eights.resize(sum as usize, 0);
        let mut next = index.stretches.clone();
        for (number, eight) in (0..).zip(eights) {
            let first = index.stretch(eight.from_m);
            for stretch in first..=index.stretch(eight.to_m) {
                let Some(stretch_of) = next.get_mut(stretch) else { continue };
                let place = if stretch > first { &mut stretch_of.start } else { &mut stretch_of.end };
                if let Some(listed) = index.eights.get_mut(*place as usize) {
                    *listed = number;
                }
                *place += 1;
            }
        }
        for (stretch, filled) in index.stretches.iter_mut().zip(next) {
            stretch.end = filled.end;
        }
        index
    }

    /// The stretch of a place; never falls as places rise, so what reaches over a place is listed in its stretch.
    fn stretch(&self, y_m: f64) -> usize {
        let number = ((y_m - self.first_m) * self.stretches_per_m) as usize;
        number.min(self.stretches.len().saturating_sub(1))
    }

    /// Lists of eights, of which no other may hold any extent that touches [low, high]; none comes twice.
    pub(super) fn eights(&self, (low_m, high_m): (f64, f64)) -> impl Iterator<Item = &[u32]> {
        let (first, last) = (self.stretch(low_m), self.stretch(high_m));
        let stretches = self.stretches.get(first..=last).unwrap_or(&[]);
        stretches.iter().enumerate().map(|(number, stretch)| {
            let from = if number == 0 { stretch.start } else { stretch.begun };
            self.eights.get(from as usize..stretch.end as usize).unwrap_or(&[])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_index_finds_what_a_search_of_all_finds_and_nothing_twice(
            spans in prop::collection::vec((-5.0..25.0f64, 0.0..3.0f64, 0..4), 0..80),
            y in -6.0..26.0f64, more in 0.0..2.0f64,
        ) {
            let extents: Vec<YExtent> = spans
                .iter()
                .map(|&(from_m, length, scale)| YExtent { from_m, to_m: from_m + length * 0.1f64.powi(scale) })
                .collect();
            let (index, order) = RowIndex::new(&extents);
            for high in [y, y + more] {
                let eights: Vec<usize> = index.eights((y, high)).flatten().map(|eight| *eight as usize).collect();
                let entries = eights.iter().flat_map(|eight| eight * WIDTH..(eight + 1) * WIDTH);
                let touches = |i: &usize| extents[*i].from_m <= high && y <= extents[*i].to_m;
                let numbers = entries.map(|entry| order[entry] as usize).filter(|number| *number < extents.len());
                let mut found: Vec<usize> = numbers.filter(touches).collect();
                found.sort_unstable();
                let all: Vec<usize> = (0..extents.len()).filter(touches).collect();
                prop_assert_eq!(found, all);
            }
        }

        #[test]
        fn images_are_exactly_those_that_reach_into_the_period(
            from_m in -30.0..30.0f64, length in 0.0..12.0f64, period in 0.5..10.0f64,
        ) {
            let extent = YExtent { from_m, to_m: from_m + length };
            let images: Vec<f64> = extent.images(period).collect();
            for k in -100..=100 {
                let shift = f64::from(k) * period;
                let reaches = extent.to_m + shift > 1e-9 && extent.from_m + shift < period - 1e-9;
                prop_assert!(!reaches || images.iter().any(|image| (image - shift).abs() < 1e-9));
            }
        }
    }
}
