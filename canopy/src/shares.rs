//! The share of its spot that each beam's leaves took, by range and remission.

use std::f64::consts::LN_10;

use rowscan_protocol::optics::DAZZLED;

use crate::by_range::ByRange;
use crate::parameters::Parameters;
use crate::remission::RemissionScale;

/// Shares by range and remission, through one spot.
#[derive(Clone, Debug)]
pub(crate) struct Shares {
    scale: RemissionScale,
    /// What remission is where leaves' share is 1, digits, by range.
    digits: ByRange,
}

impl Shares {
    /// `None` where remission is not read.
    pub(crate) fn new(parameters: &Parameters) -> Option<Self> {
        let scale = parameters.remission?;
        let digits = |range_m: f64| {
            let rims = 1.0 - 1.0 / parameters.inflation(range_m).max(1.0);
            scale.full_digits(range_m) + scale.digits_a_decade * (LONGER * rims).ln_1p() / LN_10
        };
        Some(Self { scale, digits: ByRange::of(digits) })
    }

    /// The share of the spot that leaves took of which so much came back from this range; above 1 for leaves less slanted than the mean. NaN where there is no
    /// echo, or none with remission, or too far away.
    pub(crate) fn of(&self, range_m: f64, remission: u16) -> f64 {
        let Some(full) = self.digits.at(range_m).filter(|_| remission > 0) else {
            return f64::NAN;
        };
        if remission == DAZZLED || remission == DAZZLED / BYTES {
            return self.scale.most;
        }
        let digits =
            f64::from(remission) / if remission > u16::from(u8::MAX) { f64::from(BYTES) } else { 1.0 };
        10_f64.powf((digits - full) / self.scale.digits_a_decade).min(self.scale.most)
    }
}

/// Digits of a 16-bit value that holds an 8-bit one in both bytes, a digit.
const BYTES: u16 = 257;

/// How much larger remission is than power tells, where leaves stand behind one another in an echo and its pulse is longer: 1 + this · (1 − 1/I), with 1/I
/// the share of the spot that the first leaf takes on average. From simulated crowns, LMS111 and LMS511 from 1 to 4 m; 1.15 to 1.33 times was recorded on a TiM
/// at edges.
const LONGER: f64 = 0.37;
