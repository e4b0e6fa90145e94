//! Random streams keyed by what they are for, so that none depends on another or on the order of work.
//!
//! A key is folded word by word through SplitMix64's finaliser (Steele, Lea and Flood 2014), each word first spread by the
//! golden-ratio increment; four rounds of it seed a PCG-64 (state and stream). The recipe is part of the scene format:
//! changing it changes every orchard.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// What a stream of random numbers is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Stage {
    /// State draws and azimuths of the growing axes.
    Growth = 1,
    /// Jitter of leaf blades.
    Foliage = 2,
    /// Noise of the GNSS receiver, by millisecond.
    Gnss = 3,
    /// Which leaves are out in a season.
    Season = 8,
    /// Which leaves are thinned out for a target leaf area.
    Thinning = 4,
    /// Where leaves are added for a target leaf area.
    Seeding = 5,
    /// Which production of an L-system is taken.
    Rewriting = 6,
    /// Which of few distinct trees stands where, and how it is turned.
    Placing = 7,
}

/// A keyed stream of random numbers.
#[derive(Clone, Debug)]
pub struct Stream(Pcg64);

impl Stream {
    /// The stream of one `stage` of the tree numbered `tree` in row `row` of the scene with seed `seed`.
    pub fn new(seed: u64, stage: Stage, row: u32, tree: u32) -> Self {
        let key = [stage as u64, u64::from(row), u64::from(tree)];
        let folded = key.iter().fold(mix(seed), |state, word| mix(state ^ word.wrapping_mul(GOLDEN)));
        let words: [u64; 4] =
            std::array::from_fn(|i| mix(folded.wrapping_add((i as u64 + 1).wrapping_mul(GOLDEN))));
        let [a, b, c, d] = words.map(u128::from);
        Self(Pcg64::new(a << 64 | b, c << 64 | d))
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Index drawn with the given non-negative weights; None where they sum to nothing.
    pub fn weighted(&mut self, weights: &[f64]) -> Option<usize> {
        let total: f64 = weights.iter().sum();
        let mut left = self.unit() * total;
        let last = weights.iter().rposition(|w| *w > 0.0)?;
        for (i, weight) in weights.iter().enumerate() {
            left -= weight;
            if left < 0.0 {
                return Some(i);
            }
        }
        Some(last)
    }
}

/// SplitMix64: one step of the increment, then the finaliser.
fn mix(state: u64) -> u64 {
    let mut z = state.wrapping_add(GOLDEN);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_finaliser_is_splitmix64() {
        // First outputs of the reference generator started at 0.
        assert_eq!(mix(0), 0xe220_a839_7b1d_cdaf);
        assert_eq!(mix(GOLDEN), 0x6e78_9e6a_a1b9_65f4);
    }

    #[test]
    fn every_part_of_the_key_matters() {
        let first = |seed, stage, row, tree| Stream::new(seed, stage, row, tree).unit().to_bits();
        let all = [
            first(1, Stage::Growth, 0, 0),
            first(2, Stage::Growth, 0, 0),
            first(1, Stage::Foliage, 0, 0),
            first(1, Stage::Growth, 1, 0),
            first(1, Stage::Growth, 0, 1),
            first(1, Stage::Growth, 1, 1),
        ];
        for (i, a) in all.iter().enumerate() {
            assert!(all.iter().skip(i + 1).all(|b| a != b), "key {i} collides");
        }
    }

    #[test]
    fn weights_are_kept_and_impossible_draws_never_made() {
        let mut stream = Stream::new(7, Stage::Growth, 0, 0);
        let weights = [0.2, 0.0, 0.5, 0.3];
        let mut counts = [0u32; 4];
        for _ in 0..40_000 {
            counts[stream.weighted(&weights).unwrap()] += 1;
        }
        for (count, weight) in counts.iter().zip(weights) {
            let expected = 40_000.0 * weight;
            assert!((f64::from(*count) - expected).abs() <= 5.0 * (expected * (1.0 - weight)).sqrt());
        }
        assert_eq!(stream.weighted(&[0.0, 0.0]), None);
    }
}
