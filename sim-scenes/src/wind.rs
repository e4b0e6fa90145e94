//! Trees that sway in the wind, seeded and closed in time.
//!
//! Each tree swings about its foot as a stiff whole, so displacement grows with height: slow for the trunk, faster for the shoots. Leaves do not flutter
//! by themselves: within a line they move by less than a millimetre, and from line to line one leaf's turn is as good as another's.

use std::f64::consts::TAU;

use rowscan_protocol::random::Stream;
use rowscan_vehicle::ParameterError;
use rowscan_vehicle::parameter::require_within;
use serde::{Deserialize, Serialize};

/// Frequencies of trunks and of shoots, Hz, and how wide their resonances are, relative: twice the damping \[ASM\].
const MODES: [([f64; 2], f64); 2] = [([1.0, 2.0], 0.2), ([2.0, 4.0], 0.3)];

/// Waves a mode.
const WAVES: usize = 8;

/// Root mean square of a shoot tip's displacement each way at [`REFERENCE_M_S`], metres \[ASM\].
const TIP_M: f64 = 0.010;

/// Displacement grows with the square of the speed \[ASM\].
const REFERENCE_M_S: f64 = 3.0;

/// Key of the random numbers.
const PURPOSE: u64 = 202;

/// The wind: table `[wind]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Wind {
    /// Mean speed, m/s; 0 is calm.
    pub speed_m_s: f64,
    /// Height of the shoot tips, metres.
    pub tip_m: f64,
}

impl Default for Wind {
    fn default() -> Self {
        Self { speed_m_s: 0.0, tip_m: 3.0 }
    }
}

/// How far a tree leans, metres of displacement a metre of height.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lean {
    /// Towards +X.
    pub across: f64,
    /// Towards +Y.
    pub along: f64,
}

impl Wind {
    pub(crate) fn validate(&self) -> Result<(), ParameterError> {
        require_within("wind.speed_m_s", self.speed_m_s, 0.0, 15.0)?;
        require_within("wind.tip_m", self.tip_m, 0.5, 30.0)
    }

    /// How tree number `tree` of the row leans after so many seconds, in a scene with this seed.
    pub fn lean(&self, seed: u64, tree: i64, at_s: f64) -> Lean {
        if self.speed_m_s <= 0.0 {
            return Lean::default();
        }
        let gust = self.speed_m_s / REFERENCE_M_S;
        let each = TIP_M * gust * gust / self.tip_m;
        let way = |way: u64| each * sway(&mut Stream::keyed(seed, &[PURPOSE, tree as u64, way]), at_s);
        Lean { across: way(0), along: way(1) }
    }
}

/// A process of variance 1: narrow bands of waves with normal amplitudes.
fn sway(random: &mut Stream, at_s: f64) -> f64 {
    let sigma = (1.0 / (MODES.len() * WAVES) as f64).sqrt();
    let mut sum = 0.0;
    for ([low, high], width) in MODES {
        let middle = low + (high - low) * random.unit();
        for wave in 0..WAVES {
            let off = (wave as f64 + random.unit()) / WAVES as f64 - 0.5;
            let angle = TAU * middle * (1.0 + width * off) * at_s;
            let radius = sigma * (-2.0 * libm::log(1.0 - random.unit())).sqrt();
            sum += radius * libm::cos(angle + TAU * random.unit());
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tips_sway_as_far_as_the_sheet_has_it_and_with_the_square_of_the_speed() {
        let rms_m = |speed_m_s: f64| {
            let wind = Wind { speed_m_s, ..Wind::default() };
            let tips = (0..400).flat_map(|tree| {
                let tip = move |i: i32| wind.lean(1, tree, f64::from(i) * 0.37).across * wind.tip_m;
                (0..20).map(tip)
            });
            let (count, sum) =
                tips.fold((0.0_f64, 0.0_f64), |(count, sum), tip| (count + 1.0, sum + tip * tip));
            (sum / count).sqrt()
        };
        // 400 trees with 16 waves each: four standard errors.
        assert!((rms_m(3.0) / 0.010 - 1.0).abs() < 0.06, "{}", rms_m(3.0));
        assert!((rms_m(6.0) / rms_m(3.0) - 4.0).abs() < 1e-9);
        assert_eq!(rms_m(0.0), 0.0);
    }

    #[test]
    fn trees_sway_each_by_itself_and_repeat() {
        let wind = Wind { speed_m_s: 4.0, ..Wind::default() };
        assert_eq!(wind.lean(1, 3, 7.7), wind.lean(1, 3, 7.7));
        assert_ne!(wind.lean(1, 3, 7.7), wind.lean(1, 4, 7.7));
        assert_ne!(wind.lean(1, 3, 7.7), wind.lean(2, 3, 7.7));
        // From line to line at 50 Hz: no wave is faster than 4.6 Hz, and amplitudes of five sigma would be 18 mm each way.
        let off = (wind.lean(1, 3, 7.72).across - wind.lean(1, 3, 7.70).across).abs() * wind.tip_m;
        assert!(off < TAU * 4.6 * 0.02 * 5.0 * TIP_M * 16.0 / 9.0, "{off}");
    }
}
