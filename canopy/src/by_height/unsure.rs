//! How far a band's leaf area may be off, beside its row.
//!
//! What a row's blocks scatter by is not all: at a crown's top and base beams meet wood for leaves, or thin tips not at all, in every block alike. How much that is, the study of
//! bands says, in three numbers for rays and three for beams with a width.

use crate::regression::Z95;
use crate::uncertainty::combined;

/// Height of a band that the numbers below are of, metres.
const STUDIED_M: f64 = 0.25;

/// Standard deviations that all blocks of a row share, of bands of [`STUDIED_M`]; those of lower bands are larger, by the root. Chosen on 16 rows of `spindle` and `mature` (LMS111 at
/// 2 m, bands of 0.1, 0.25 and 0.5 m; `rowscan study pieces spindle mature --seeds 2001..2008 --model lms111 --distance 2`), that the intervals of row and tree hold 90 % of the bands of `mature` and 98 % of
/// those of `spindle`, about.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shared {
    /// Of the band's own leaf area.
    of_band: f64,
    /// Of the steps to the leaf areas of the bands below and above.
    of_step: f64,
    /// Of the mean band's leaf area.
    of_mean: f64,
}

impl Shared {
    /// Of rays.
    const RAYS: Self = Self { of_band: 0.0, of_step: 0.03, of_mean: 0.015 };
    /// Of beams with a width.
    const WIDE: Self = Self { of_band: 0.03, of_step: 0.12, of_mean: 0.07 };

    /// Of bands of this height.
    pub(super) fn of(have_width: bool, band_m: f64) -> Self {
        let Self { of_band, of_step, of_mean } = if have_width { Self::WIDE } else { Self::RAYS };
        let times = (STUDIED_M / band_m).sqrt();
        Self { of_band: times * of_band, of_step: times * of_step, of_mean: times * of_mean }
    }
}

/// What is known of a band's error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unsure {
    pub(super) shared: Shared,
    /// Relative standard deviation by the row's blocks.
    pub(super) sampling: f64,
    /// Leaf area of the bands below and above, m².
    pub(super) neighbours_m2: [f64; 2],
    /// Of the mean band, m².
    pub(super) mean_m2: f64,
}

/// The ends within which a band lies with 95 %, m², by its own error and a relative standard deviation that all bands share. Never below 0.
pub(super) fn ends_m2(leaf_m2: f64, row_sd: f64, unsure: Unsure) -> [f64; 2] {
    let Unsure { shared, sampling, neighbours_m2: [below_m2, above_m2], mean_m2 } = unsure;
    let own_m2 = leaf_m2 * combined([row_sd, sampling, shared.of_band]);
    let step_m2 = shared.of_step * (below_m2 - leaf_m2).hypot(above_m2 - leaf_m2);
    let half_m2 = Z95 * own_m2.hypot(step_m2).hypot(shared.of_mean * mean_m2);
    [(leaf_m2 - half_m2).max(0.0), leaf_m2 + half_m2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unsure(sampling: f64, neighbours_m2: [f64; 2]) -> Unsure {
        Unsure { shared: Shared::of(false, 0.25), sampling, neighbours_m2, mean_m2: 10.0 }
    }

    #[test]
    fn an_interval_grows_with_every_cause_and_never_goes_below_nothing() {
        let width = |leaf_m2, row_sd, unsure| {
            let [low_m2, high_m2] = ends_m2(leaf_m2, row_sd, unsure);
            assert!(low_m2 >= 0.0 && low_m2 <= leaf_m2 && high_m2 >= leaf_m2);
            high_m2 - low_m2
        };
        let even = width(10.0, 0.05, unsure(0.02, [10.0, 10.0]));
        assert!(width(10.0, 0.1, unsure(0.02, [10.0, 10.0])) > even);
        assert!(width(10.0, 0.05, unsure(0.1, [10.0, 10.0])) > even);
        assert!(width(10.0, 0.05, unsure(0.02, [2.0, 10.0])) > even);
        let wide = Unsure { shared: Shared::of(true, 0.25), ..unsure(0.02, [10.0, 10.0]) };
        let low = Unsure { shared: Shared::of(false, 0.1), ..unsure(0.02, [10.0, 10.0]) };
        assert!(width(10.0, 0.05, wide) > even && width(10.0, 0.05, low) > even);
        // That nothing is there is not sure, either.
        assert!(width(0.0, 0.05, unsure(0.0, [0.0, 0.0])) > 0.0);
    }
}
