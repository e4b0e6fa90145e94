//! Foliage of the tests of this crate.

/// How far a beam goes to a leaf at `y_m` along the row, metres, endless through a gap: leaves of 5 cm, whose edges lie elsewhere for each beam, and none of which
/// is like one so many before it, for a canopy does not repeat itself.
pub(crate) fn leaf_depth_m(beam: i64, y_m: f64) -> f64 {
    let leaf = (y_m / 0.05 + (beam * 37).rem_euclid(50) as f64 / 50.0).floor() as i64;
    // The steps of SplitMix64, which spread neighbouring numbers.
    let number = ((beam * 1000 + leaf) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    match ((number ^ (number >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) % 10 {
        0..=3 => f64::INFINITY,
        depth => 1.0 + 0.2 * depth as f64,
    }
}
