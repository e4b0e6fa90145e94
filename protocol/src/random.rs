//! Random streams keyed by what they are for, so that none depends on another or on the order of work.
//!
//! A key is folded word by word through SplitMix64's finaliser (Steele, Lea and Flood 2014), each word first spread by the
//! golden-ratio increment; four rounds of it seed a PCG-64 (state and stream). The recipe is part of the scene format:
//! changing it changes every orchard.

use core::array;
use core::convert::Infallible;

pub use rand::{Rng, TryRng};
use rand_pcg::Pcg64;

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A keyed stream of random numbers. Whatever takes a generator of the `rand` crate takes it.
///
/// ```
/// use rowscan_protocol::random::{Rng, Stream};
/// let mut one = Stream::keyed(1, &[4, 0, 7]);
/// let mut other = Stream::keyed(1, &[4, 0, 8]);
/// assert_ne!(one.next_u64(), other.next_u64());
/// assert_eq!(Stream::keyed(1, &[4, 0, 7]).unit(), Stream::keyed(1, &[4, 0, 7]).unit());
/// ```
#[derive(Clone, Debug)]
pub struct Stream(Pcg64);

impl Stream {
    /// The stream of `key` under `seed`. The first word of a key says what the stream is for.
    pub fn keyed(seed: u64, key: &[u64]) -> Self {
        let folded = key.iter().fold(mix(seed), |state, word| mix(state ^ word.wrapping_mul(GOLDEN)));
        let words: [u64; 4] =
            array::from_fn(|i| mix(folded.wrapping_add((i as u64 + 1).wrapping_mul(GOLDEN))));
        let [a, b, c, d] = words.map(u128::from);
        Self(Pcg64::new(a << 64 | b, c << 64 | d))
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
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

impl TryRng for Stream {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        self.0.try_next_u32()
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        self.0.try_next_u64()
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        self.0.try_fill_bytes(bytes)
    }
}

/// SplitMix64: one step of the increment, then the finaliser.
pub fn mix(state: u64) -> u64 {
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
    fn whatever_takes_a_generator_of_rand_takes_a_stream() {
        use rand::RngExt;
        use rand::seq::SliceRandom;
        let mut order = [0, 1, 2, 3, 4, 5, 6, 7];
        order.shuffle(&mut Stream::keyed(1, &[4]));
        assert_ne!(order, [0, 1, 2, 3, 4, 5, 6, 7]);
        // Of 64 bits the upper 53, as `unit` has them.
        let drawn: f64 = Stream::keyed(1, &[4]).random();
        assert_eq!(drawn.to_bits(), Stream::keyed(1, &[4]).unit().to_bits());
    }

    #[test]
    fn every_part_of_the_key_matters() {
        let first = |seed, key: &[u64]| Stream::keyed(seed, key).unit().to_bits();
        let all = [
            first(1, &[1, 0, 0]),
            first(2, &[1, 0, 0]),
            first(1, &[2, 0, 0]),
            first(1, &[1, 1, 0]),
            first(1, &[1, 0, 1]),
            first(1, &[1, 1, 1]),
            first(1, &[1, 0]),
        ];
        for (i, a) in all.iter().enumerate() {
            assert!(all.iter().skip(i + 1).all(|b| a != b), "key {i} collides");
        }
    }

    #[test]
    fn weights_are_kept_and_impossible_draws_never_made() {
        let mut stream = Stream::keyed(7, &[1, 0, 0]);
        let weights = [0.2, 0.0, 0.5, 0.3];
        let mut counts = [0u32; 4];
        for _ in 0..40_000 {
            counts[stream.weighted(&weights).unwrap()] += 1;
        }
        for (count, weight) in counts.into_iter().zip(weights) {
            let expected = 40_000.0 * weight;
            let deviation = f64::from(count) - expected;
            assert!(deviation * deviation <= 25.0 * expected * (1.0 - weight), "{count} of {expected}");
        }
        assert_eq!(stream.weighted(&[0.0, 0.0]), None);
    }
}
