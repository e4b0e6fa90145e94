//! How close together leaves stand, measured from the scans themselves, and what it makes of hits by beams with a width.
//!
//! A spot meets a leaf wherever it touches its rim, so its beams end too often. How often hangs on how many rims there are: leaves of a clump share theirs
//! ([`Footprint`](crate::Footprint) has a constant κ for it, which fits no thin row and no dense one). The same scans tell it. Blocks of neighbouring beams over two
//! spots, each as one beam that ends only where all of its beams do, meet what is larger than a spot and pass what only a rim made: a closing of the scan, as
//! in mathematical morphology. Contact of blocks over that of beams is the measure `closed`, and raw leaf areas are multiplied by exp(constant + slope · ln closed).
//! The law is fitted on what rays read of rows of six training systems, by `rowscan study clumping`; its slope is about 1, so in effect the blocks are counted.

use serde::Serialize;

use crate::clumping_law::ClumpingLaw;

/// How the leaves of a row stand, and what that makes of its raw leaf area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Clumping {
    /// Contact of blocks of beams that end where all of them do over that of the beams.
    pub closed: f64,
    /// What raw leaf areas are multiplied by, before a calibration's scale; `None` where no law was fitted for such optics.
    pub factor: Option<f64>,
    /// Leaf areas go by it: a calibration says that it was fitted so. The factor of the row so far may change by a tenth along a row.
    pub applied: bool,
    /// Relative standard deviation of leaf areas by the factor: the law's, where such rows were fitted.
    pub relative_sd: f64,
    /// The same by the constant.
    pub constant_sd: f64,
}

impl Clumping {
    /// Of leaf areas by blocks and by beams, both raw, m²; `None` where nothing was hit.
    pub(crate) fn of(
        closed_m2: f64,
        contact_m2: f64,
        law: Option<&ClumpingLaw>,
        constant_sd: f64,
    ) -> Option<Self> {
        let closed = closed_m2 / contact_m2;
        let factor = law.map(|law| law.factor(closed));
        let relative_sd = law.filter(|law| law.holds(closed)).map_or(constant_sd, |law| law.relative_sd);
        let told = Self { closed, factor, applied: false, relative_sd, constant_sd };
        (closed.is_finite() && closed > 0.0).then_some(told)
    }

    /// What leaf areas are multiplied by.
    pub(crate) fn times(&self) -> f64 {
        self.factor.filter(|_| self.applied).unwrap_or(1.0)
    }
}
