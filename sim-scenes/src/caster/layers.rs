//! What every beam of a line met: the nearest surface, and the first leaves before the first wood.

use super::returns::{Class, Return};

/// The leaves along every beam of one line. Reused from line to line.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    depth: usize,
    nearest: Vec<Return>,
    /// `depth` for each beam.
    leaves: Vec<Return>,
    counts: Vec<usize>,
}

impl Layers {
    /// Number of beams.
    pub fn len(&self) -> usize {
        self.nearest.len()
    }

    /// True if there is no beam.
    pub fn is_empty(&self) -> bool {
        self.nearest.is_empty()
    }

    /// What each beam met first: leaf, wood, ground or nothing. The same as [`super::Caster::cast`] gives.
    pub fn nearest(&self) -> &[Return] {
        &self.nearest
    }

    /// The leaves along beam `j` before the first wood and the ground, nearest first: distinct ones, at most the k requested.
    pub fn leaves(&self, j: usize) -> &[Return] {
        let count = self.counts.get(j).copied().unwrap_or(0);
        let start = j.saturating_mul(self.depth);
        self.leaves.get(start..start.saturating_add(count)).unwrap_or(&[])
    }

    pub(crate) fn reset(&mut self, beams: usize, depth: usize) {
        self.depth = depth;
        self.nearest.clear();
        self.nearest.resize(beams, Return::MISS);
        self.leaves.clear();
        self.leaves.resize(beams * depth, Return::MISS);
        self.counts.clear();
        self.counts.resize(beams, 0);
    }

    /// Notes what beam `j` met; `found` gives it from the nearest on, leaves and at most one other surface.
    pub(crate) fn set(&mut self, j: usize, found: impl Iterator<Item = Return>) {
        let Some(nearest) = self.nearest.get_mut(j) else { return };
        let Some(count) = self.counts.get_mut(j) else { return };
        let slots = self.leaves.get_mut(j * self.depth..(j + 1) * self.depth).unwrap_or(&mut []);
        for (place, hit) in found.enumerate() {
            if place == 0 {
                *nearest = hit;
            }
            if hit.class != Class::Leaf {
                break;
            }
            let Some(slot) = slots.get_mut(*count) else { break };
            *slot = hit;
            *count += 1;
        }
    }
}
