//! Standard normal numbers by Marsaglia and Tsang's ziggurat, in Doornik's form: most take one multiplication, and the distribution is exact.

use std::sync::LazyLock;

/// Layers of equal area under the density.
const LAYERS: usize = 128;

/// Where the tail begins, and the area of a layer.
const TAIL: f64 = 3.442_619_855_899;
const AREA: f64 = 9.912_563_035_262_17e-3;

/// How far a layer reaches, and the next one above it.
static ENDS: LazyLock<[[f64; 2]; LAYERS]> = LazyLock::new(|| {
    let density = |x: f64| libm::exp(-0.5 * x * x);
    // The lowest layer is as wide as one of its area would be without the tail.
    let mut end = AREA / density(TAIL);
    let mut next = TAIL;
    std::array::from_fn(|layer| {
        let ends = [end, if layer + 1 < LAYERS { next } else { 0.0 }];
        let height = AREA / next + density(next);
        (end, next) = (next, if height < 1.0 { (-2.0 * libm::log(height)).sqrt() } else { 0.0 });
        ends
    })
});

/// From random bits to [0, 1).
pub(super) fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// A standard normal number from a source of random bits.
pub(super) fn normal(mut bits: impl FnMut() -> u64) -> f64 {
    loop {
        let word = bits();
        // The unit has the upper bits, the layer the lowest.
        let (layer, side) = (word as usize % LAYERS, 2.0 * unit(word) - 1.0);
        let [end, next] = ENDS[layer];
        let value = side * end;
        if value.abs() < next {
            return value;
        }
        if layer == 0 {
            return tail(&mut bits).copysign(side);
        }
        let below = |end: f64| libm::exp(-0.5 * (end * end - value * value));
        let (low, high) = (below(end), below(next));
        if high + unit(bits()) * (low - high) < 1.0 {
            return value;
        }
    }
}

/// Beyond [`TAIL`] (Marsaglia 1964).
#[cold]
fn tail(bits: &mut impl FnMut() -> u64) -> f64 {
    loop {
        let [beyond, under] = [(); 2].map(|()| -libm::log(1.0 - unit(bits())));
        let beyond = beyond / TAIL;
        if 2.0 * under >= beyond * beyond {
            return TAIL + beyond;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::random::mix;

    #[test]
    fn layers_are_of_one_area_and_the_topmost_ends_at_the_peak() {
        let density = |x: f64| libm::exp(-0.5 * x * x);
        for [end, next] in &ENDS[1..] {
            assert!((end * (density(*next) - density(*end)) / AREA - 1.0).abs() < 1e-6, "{end}");
        }
    }

    #[test]
    fn numbers_are_distributed_as_normals_are_far_into_the_tail() {
        let mut state = 7u64;
        let mut bits = || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            mix(state)
        };
        let n = 1_000_000;
        let mut values: Vec<f64> = (0..n).map(|_| normal(&mut bits)).collect();
        values.sort_by(f64::total_cmp);
        let cdf = |x: f64| 0.5 * libm::erfc(-x / std::f64::consts::SQRT_2);
        // Kolmogorov and Smirnov: exceeded once in a thousand.
        let worst = (0..).zip(&values).map(|(k, x)| (cdf(*x) - (f64::from(k) + 0.5) / f64::from(n)).abs());
        assert!(worst.fold(0.0, f64::max) < 1.95 / f64::from(n).sqrt());
        for bound in [2.0, 3.0, TAIL, 4.0] {
            let expected = 2.0 * cdf(-bound) * f64::from(n);
            let found = values.iter().filter(|x| x.abs() > bound).count() as f64;
            assert!((found - expected).abs() < 4.0 * expected.sqrt(), "{bound}: {found}, {expected}");
        }
    }
}
