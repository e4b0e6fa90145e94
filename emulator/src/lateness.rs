//! How late things went out: a histogram of fixed size, however long it runs.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Buckets an octave of microseconds: quantiles are true to 6 %.
const FINE: u32 = 16;
/// Octaves: up to 2^32 µs.
const OCTAVES: u32 = 32;

/// Counts by lateness.
#[derive(Debug)]
pub(crate) struct Lateness([AtomicU64; (FINE * OCTAVES) as usize]);

impl Default for Lateness {
    fn default() -> Self {
        Self(std::array::from_fn(|_| AtomicU64::new(0)))
    }
}

impl Lateness {
    /// One more, so late.
    pub(crate) fn note(&self, late: Duration) {
        if let Some(count) = self.0.get(bucket(late.as_micros() as u64)) {
            count.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The lateness that `fraction` of all stayed under; none if there was nothing.
    pub(crate) fn quantile(&self, fraction: f64) -> Option<Duration> {
        let counts: Vec<u64> = self.0.iter().map(|count| count.load(Ordering::Relaxed)).collect();
        let all: u64 = counts.iter().sum();
        let wanted = ((all as f64 * fraction).ceil() as u64).max(1);
        let mut seen = 0;
        let found = counts.iter().position(|count| {
            seen += count;
            seen >= wanted
        });
        found.map(|bucket| Duration::from_micros(upper_us(bucket)))
    }
}

fn bucket(us: u64) -> usize {
    let us = us.clamp(1, (1 << OCTAVES) - 1);
    let octave = us.ilog2();
    let within = (us << OCTAVES >> octave) - (1 << OCTAVES);
    (octave * FINE) as usize + ((within * u64::from(FINE)) >> OCTAVES) as usize
}

/// The most a bucket holds.
fn upper_us(bucket: usize) -> u64 {
    let (octave, within) = (bucket as u32 / FINE, bucket as u64 % u64::from(FINE) + 1);
    (1_u64 << octave) + ((within << octave) / u64::from(FINE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_near_and_never_below() {
        let lateness = Lateness::default();
        assert_eq!(lateness.quantile(0.5), None);
        (1..=1000).for_each(|us| lateness.note(Duration::from_micros(us)));
        for (fraction, exact) in [(0.5, 500.0), (0.99, 990.0)] {
            let found = lateness.quantile(fraction).expect("some").as_micros() as f64;
            assert!(found >= exact && found <= exact * 1.07, "{fraction}: {found}");
        }
        lateness.note(Duration::from_secs(100_000));
        assert!(lateness.quantile(1.0).expect("some") > Duration::from_secs(4000));
    }
}
