//! What every beam of a line has met nearest so far.

/// The owner of a beam that met nothing.
pub(super) const NOBODY: u32 = u32::MAX;

/// The largest depth keys and whose they are, beam by beam: `depth` slots a beam, nearest first. Surfaces that end a beam (wood,
/// ground) are the floor: they fill all slots, so that no leaf behind them enters.
#[derive(Clone, Debug, Default)]
pub(super) struct Nearest {
    depth: usize,
    key: Vec<f64>,
    owner: Vec<u32>,
}

impl Nearest {
    /// Forgets everything, for a line of `beams` beams. Allocates only where a line is longer than any before.
    pub(super) fn reset(&mut self, beams: usize, depth: usize, farthest: f64) {
        self.depth = depth;
        self.key.clear();
        self.key.resize(beams * depth, farthest);
        self.owner.clear();
        self.owner.resize(beams * depth, NOBODY);
    }

    /// Enters what ends a beam. All such come before the first leaf.
    pub(super) fn offer_floor(&mut self, beam: usize, key: f64, owner: u32) {
        let slots = beam * self.depth..(beam + 1) * self.depth;
        let (Some(keys), Some(owners)) = (self.key.get_mut(slots.clone()), self.owner.get_mut(slots)) else {
            return;
        };
        if keys.first().is_some_and(|best| key > *best) {
            keys.fill(key);
            owners.fill(owner);
        }
    }

    /// Enters a leaf.
    pub(super) fn offer(&mut self, beam: usize, key: f64, owner: u32) {
        let slots = beam * self.depth..(beam + 1) * self.depth;
        let (Some(keys), Some(owners)) = (self.key.get_mut(slots.clone()), self.owner.get_mut(slots)) else {
            return;
        };
        let (mut key, mut owner) = (key, owner);
        for (best, whose) in keys.iter_mut().zip(owners) {
            if key > *best {
                std::mem::swap(&mut key, best);
                std::mem::swap(&mut owner, whose);
            }
        }
    }

    /// (key, owner) of a beam, nearest first.
    pub(super) fn beam(&self, beam: usize) -> impl Iterator<Item = (f64, u32)> + '_ {
        let slots = beam * self.depth..(beam + 1) * self.depth;
        let keys = self.key.get(slots.clone()).unwrap_or(&[]);
        keys.iter().copied().zip(self.owner.get(slots).unwrap_or(&[]).iter().copied())
    }
}
