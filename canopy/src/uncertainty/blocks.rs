//! The sampling error of a row from its own blocks.
//!
//! The row is cut into blocks of two metres, longer than trees are apart, so that blocks are nearly independent. What is drawn anew is a block's
//! pair of leaf area and impacted area; the statistic is the ratio of their sums, because the row's impacted area is known (the ratio estimator
//! of survey sampling, Cochran 1977, from memory). Blocks that simply hold larger trees do not widen it; blocks that look alike and hold
//! other leaf areas do.

use rowscan_protocol::random::Stream;

use crate::trees::Cell;

/// Length of a block, metres of row.
pub(crate) const BLOCK_M: i64 = 2;
/// Fewest blocks that tell a spread.
pub(crate) const FEWEST: usize = 4;
/// Most blocks: a longer row has longer ones.
pub(crate) const MOST: usize = 200;
/// Rows drawn.
const DRAWS: u32 = 400;
/// The key of the random stream: an estimate repeats to the last bit.
const SEED: u64 = 0x0062_6c6f_636b;

/// The relative standard deviation of a row's leaf area by its metres, and the number of blocks.
///
/// # Errors
/// How many blocks there are, where they tell no spread.
pub(crate) fn relative_sd<'a>(metres: impl Iterator<Item = &'a Cell> + Clone) -> Result<(f64, u32), usize> {
    let blocks = blocks(metres);
    let count = blocks.len();
    bootstrap(&blocks).zip(u32::try_from(count).ok()).ok_or(count)
}

fn blocks<'a>(metres: impl Iterator<Item = &'a Cell> + Clone) -> Vec<[f64; 2]> {
    let indices = metres.clone().map(|cell| cell.index);
    let Some((first, last)) = metres.clone().next().map(|cell| cell.index).zip(indices.max()) else {
        return Vec::new();
    };
    let length = BLOCK_M * ((last - first) / (BLOCK_M * MOST as i64) + 1);
    let mut blocks: Vec<[f64; 2]> = Vec::new();
    let mut open = None;
    for cell in metres {
        let block = (cell.index - first) / length;
        if open != Some(block) {
            blocks.push([0.0; 2]);
            open = Some(block);
        }
        if let Some([leaf_m2, impacted_m2]) = blocks.last_mut() {
            *leaf_m2 += cell.contact_m2;
            *impacted_m2 += cell.impacted_m2;
        }
    }
    blocks
}

fn bootstrap(blocks: &[[f64; 2]]) -> Option<f64> {
    let n = blocks.len();
    if n < FEWEST {
        return None;
    }
    let mut stream = Stream::keyed(SEED, &[n as u64]);
    let mut ratios = Vec::with_capacity(DRAWS as usize);
    for _ in 0..DRAWS {
        let mut sums = [0.0; 2];
        for _ in 0..n {
            let drawn = ((stream.unit() * n as f64) as usize).min(n - 1);
            if let Some([leaf_m2, impacted_m2]) = blocks.get(drawn) {
                sums = [sums[0] + leaf_m2, sums[1] + impacted_m2];
            }
        }
        if sums[1] > 0.0 {
            ratios.push(sums[0] / sums[1]);
        }
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let squares: f64 = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum();
    // Drawing from n values leaves out the n-th part of their variance.
    let variance = squares / (ratios.len() as f64 - 1.0) * n as f64 / (n as f64 - 1.0);
    Some(variance.sqrt() / mean).filter(|sd| sd.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(leaf: impl Fn(i64) -> [f64; 2], metres: i64) -> Vec<Cell> {
        let cell = |index| {
            let [contact_m2, impacted_m2] = leaf(index);
            Cell { index, contact_m2, impacted_m2, ..Cell::default() }
        };
        (0..metres).map(cell).collect()
    }

    #[test]
    fn blocks_of_one_ratio_have_no_spread_however_large() {
        let same = cells(|i| [5.0 * (1 + i % 5) as f64, (1 + i % 5) as f64], 40);
        let (sd, blocks) = relative_sd(same.iter()).unwrap();
        assert!(sd < 1e-12 && blocks == 20, "{sd} {blocks}");
    }

    #[test]
    fn the_spread_is_the_standard_error_of_the_mean() {
        // Blocks of 0.9 and 1.1: standard deviation 0.1026 over 40 blocks.
        let two = cells(|i| [if i / 2 % 2 == 0 { 0.9 } else { 1.1 }, 1.0], 80);
        let (sd, blocks) = relative_sd(two.iter()).unwrap();
        let expected = 0.1 * (40.0f64 / 39.0).sqrt() / 40.0f64.sqrt();
        assert!(blocks == 40 && (sd / expected - 1.0).abs() < 0.1, "{sd} {expected}");
        assert_eq!(relative_sd(two.iter()), Ok((sd, blocks)), "it repeats");
    }

    #[test]
    fn a_short_row_tells_nothing_and_a_long_one_stays_bounded() {
        assert_eq!(relative_sd(cells(|_| [1.0, 1.0], 6).iter()), Err(3));
        let (_, blocks) = relative_sd(cells(|_| [1.0, 1.0], 10_000).iter()).unwrap();
        assert!((100..=200).contains(&blocks), "{blocks}");
    }
}
