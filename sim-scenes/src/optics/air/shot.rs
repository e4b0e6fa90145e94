//! The shot that air acts on.

use crate::optics::draws::{Draws, Use};

/// Longest layer that one pulse gathers light from, metres: half of 5 ns \[ASM\].
pub(super) const PULSE_M: f64 = 0.75;

/// The shot that air acts on.
#[derive(Clone, Copy, Debug)]
pub(in crate::optics) struct Shot {
    pub(in crate::optics) seed: u64,
    pub(in crate::optics) scan: u64,
    pub(in crate::optics) beam: usize,
    /// θ of the beam, radians.
    pub(in crate::optics) theta_rad: f64,
}

impl Shot {
    pub(super) fn draws(&self, purpose: Use) -> Draws {
        Draws::of(self.seed, purpose, self.scan).beam(self.beam)
    }
}
