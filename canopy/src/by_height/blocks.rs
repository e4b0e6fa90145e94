//! What a band's leaf area scatters by along the row.
//!
//! The sample is blocks of two metres of whole slices, as for the row's own sampling error; the statistic is a band's leaf area over its impacted area, as a ratio of sums
//! (Cochran 1977, from memory, eq. 6.4): blocks that simply hold more of the band do not widen it.

use super::band_sums::BandSums;
use crate::leaf::Count;
use crate::uncertainty::blocks::{BLOCK_M, FEWEST, MOST};

/// Blocks of the row, in the order of travel.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    length_m: f64,
    bands: usize,
    /// By their place along the row: what their bands hold.
    blocks: Vec<(i64, Vec<BandSums>)>,
}

impl Blocks {
    pub(super) fn new(bands: usize) -> Self {
        Self { length_m: BLOCK_M as f64, bands, blocks: Vec::new() }
    }

    /// Adds a slice around `y_m`.
    pub(super) fn add(&mut self, y_m: f64, slice: &[BandSums]) {
        let mut index = (y_m / self.length_m).floor() as i64;
        if !self.blocks.iter().any(|(known, _)| *known == index) {
            if self.blocks.len() >= MOST {
                self.join_neighbours();
                index = index.div_euclid(2);
            }
            if !self.blocks.iter().any(|(known, _)| *known == index) {
                self.blocks.push((index, vec![BandSums::default(); self.bands]));
            }
        }
        let block = self.blocks.iter_mut().rev().find(|(known, _)| *known == index);
        for (sum, band) in block.into_iter().flat_map(|(_, block)| block).zip(slice) {
            sum.add(band);
        }
    }

    /// Makes blocks twice as long.
    fn join_neighbours(&mut self) {
        self.length_m *= 2.0;
        let mut joined: Vec<(i64, Vec<BandSums>)> = Vec::with_capacity(MOST);
        for (index, bands) in self.blocks.drain(..) {
            let index = index.div_euclid(2);
            match joined.iter_mut().find(|(known, _)| *known == index) {
                Some((_, sums)) => sums.iter_mut().zip(&bands).for_each(|(sum, band)| sum.add(band)),
                None => joined.push((index, bands)),
            }
        }
        self.blocks = joined;
    }

    /// Blocks so far.
    pub(super) fn count(&self) -> usize {
        self.blocks.len()
    }

    /// Whether there are enough to tell a spread.
    pub(super) fn are_enough(&self) -> bool {
        self.count() >= FEWEST
    }

    /// The relative standard deviation of a band's leaf area over the row; `None` where there are too few blocks, or there is no leaf in it.
    pub(super) fn relative_sd(&self, band: usize, count: Count) -> Option<f64> {
        if !self.are_enough() {
            return None;
        }
        let blocks = || self.blocks.iter().filter_map(|(_, bands)| bands.get(band));
        let leaf_m2 = |block: &BandSums| block.raw_m2(count);
        let (leaf, impacted) = blocks()
            .fold((0.0, 0.0), |(leaf, area), block| (leaf + leaf_m2(block), area + block.impacted_m2));
        if !(leaf > 0.0 && impacted > 0.0) {
            return None;
        }
        let squares: f64 =
            blocks().map(|block| (leaf_m2(block) - leaf / impacted * block.impacted_m2).powi(2)).sum();
        let n = self.count() as f64;
        Some((n / (n - 1.0) * squares).sqrt() / leaf)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks(of: impl Fn(usize) -> [f64; 2], slices: usize) -> Blocks {
        let mut blocks = Blocks::new(1);
        for number in 0..slices {
            let [contact_m2, impacted_m2] = of(number);
            blocks.add(
                number as f64 * 0.25 + 0.1,
                &[BandSums { contact_m2, impacted_m2, ..BandSums::default() }],
            );
        }
        blocks
    }

    #[test]
    fn blocks_of_one_ratio_have_no_spread_and_others_that_of_their_mean() {
        let same = blocks(|k| [3.0 * (1 + k % 7) as f64, (1 + k % 7) as f64], 80);
        assert!(same.count() == 10 && same.relative_sd(0, Count::Hits).unwrap() < 1e-12);
        // Blocks of eight slices, 0.9 and 1.1 in turn.
        let two = blocks(|k| [if k / 8 % 2 == 0 { 0.9 } else { 1.1 }, 1.0], 320);
        let expected = 0.1 * (40.0f64 / 39.0).sqrt() / 40.0f64.sqrt();
        assert!((two.relative_sd(0, Count::Hits).unwrap() / expected - 1.0).abs() < 1e-9);
        assert_eq!(two.relative_sd(0, Count::Shares), None, "nothing was read");
    }

    #[test]
    fn a_short_row_tells_nothing_and_a_long_one_stays_bounded() {
        assert_eq!(blocks(|_| [1.0, 1.0], 24).relative_sd(0, Count::Hits), None);
        let long = blocks(|k| [1.0 + (k / 8 % 2) as f64, 1.0], 40_000);
        assert!((100..=200).contains(&long.count()), "{}", long.count());
        let whole: f64 = long.blocks.iter().map(|(_, bands)| bands[0].impacted_m2).sum();
        assert!((whole - 40_000.0).abs() < 1e-6, "{whole}");
    }
}
