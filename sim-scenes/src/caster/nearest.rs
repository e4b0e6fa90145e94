//! What every beam of a line has met nearest so far.

use std::ops::Range;

/// The owner of a beam that met nothing.
pub(super) const NOBODY: u32 = u32::MAX;

/// Largest inverse range and whose it is, beam by beam. Inverse, because along a plane it is linear in (cos θ, sin θ), and because
/// 0 then stands for a miss.
#[derive(Clone, Debug, Default)]
pub(super) struct Nearest {
    inverse: Vec<f64>,
    owner: Vec<u32>,
}

/// The beams of one run, one after the other in each slice.
pub(super) struct Run<'a> {
    pub(super) inverse: &'a mut [f64],
    pub(super) owner: &'a mut [u32],
}

impl Nearest {
    /// Forgets everything, for a line of `beams` beams. Allocates only where a line is longer than any before.
    pub(super) fn reset(&mut self, beams: usize) {
        self.inverse.clear();
        self.inverse.resize(beams, 0.0);
        self.owner.clear();
        self.owner.resize(beams, NOBODY);
    }

    /// The beams of a run.
    pub(super) fn run(&mut self, beams: Range<usize>) -> Run<'_> {
        Run {
            inverse: self.inverse.get_mut(beams.clone()).unwrap_or(&mut []),
            owner: self.owner.get_mut(beams).unwrap_or(&mut []),
        }
    }

    /// (inverse range, owner) of every beam.
    pub(super) fn beams(&self) -> impl Iterator<Item = (f64, u32)> + '_ {
        self.inverse.iter().copied().zip(self.owner.iter().copied())
    }
}
