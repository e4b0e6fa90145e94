//! What every beam of a line has met nearest so far.

use pulp::Simd;

use super::lanes::{Lanes, Mask, Row, WIDTH};

/// The owner of a beam that met nothing. Owners are whole numbers, kept as f64 beside the keys: every u32 is one.
pub(super) const NOBODY: f64 = -1.0;

/// The owner of a beam that met the ground.
pub(super) const GROUND: f64 = -2.0;

/// The largest depth keys and whose they are, beam by beam: `depth` slots a beam, nearest first. Surfaces that end a beam (wood,
/// ground) are the floor: they fill all slots, so that no leaf behind them enters. Where there is one slot a beam, it is the floor's own.
#[derive(Clone, Debug, Default)]
pub(super) struct Nearest {
    depth: usize,
    /// `depth` rows for each eight beams, if more than one.
    key: Vec<Row>,
    owner: Vec<Row>,
    /// What ends each beam, and |beam · normal| there.
    pub(super) floor_key: Vec<Row>,
    pub(super) floor_owner: Vec<Row>,
    pub(super) floor_cos: Vec<Row>,
}

impl Nearest {
    /// Forgets everything, for `rows` rows of beams. Allocates only where a line is longer than any before.
    pub(super) fn reset(&mut self, rows: usize, depth: usize, farthest: f64) {
        self.depth = depth;
        for (rows_of, value) in
            [(&mut self.floor_key, farthest), (&mut self.floor_owner, NOBODY), (&mut self.floor_cos, 0.0)]
        {
            rows_of.clear();
            rows_of.resize(rows, Row::splat(value));
        }
    }

    /// The floor is complete; leaves come now.
    pub(super) fn close_floor(&mut self) {
        if self.depth == 1 {
            return;
        }
        for (slots, floor) in [(&mut self.key, &self.floor_key), (&mut self.owner, &self.floor_owner)] {
            slots.resize(floor.len() * self.depth, Row::splat(0.0));
            for (slots, floor) in slots.chunks_exact_mut(self.depth).zip(floor) {
                slots.fill(*floor);
            }
        }
    }

    /// The floor has risen since it was closed: what lies behind it goes.
    pub(super) fn lower_floor(&mut self) {
        if self.depth == 1 {
            return;
        }
        let depth = self.depth;
        let slots = self.key.chunks_exact_mut(depth).zip(self.owner.chunks_exact_mut(depth));
        for ((keys, owners), (floor, whose)) in slots.zip(self.floor_key.iter().zip(&self.floor_owner)) {
            for (key, owner) in keys.iter_mut().zip(owners) {
                for lane in 0..WIDTH {
                    if key.0[lane] < floor.0[lane] {
                        key.0[lane] = floor.0[lane];
                        owner.0[lane] = whose.0[lane];
                    }
                }
            }
        }
    }

    /// Starts over with one slot a beam, which holds the floor of `other`.
    pub(super) fn open_on(&mut self, other: &Self) {
        self.depth = 1;
        self.floor_key.clone_from(&other.floor_key);
        self.floor_owner.clone_from(&other.floor_owner);
    }

    /// Makes the slots of `other` the floor. Where they are polygons, the cosine is theirs and not the floor's.
    pub(super) fn take_floor(&mut self, other: &mut Self) {
        std::mem::swap(&mut self.floor_key, &mut other.floor_key);
        std::mem::swap(&mut self.floor_owner, &mut other.floor_owner);
    }

    /// True if every beam from `low` to `high` has its last slot filled by something with a greater key than `key`.
    pub(super) fn all_nearer(&self, (low, high): (usize, usize), key: f64) -> bool {
        (low..=high).all(|beam| self.slot(beam, self.depth.saturating_sub(1)).0 > key)
    }

    /// The slots of a run of rows of beams.
    #[inline(always)]
    pub(super) fn slots(&mut self, from: usize, to: usize) -> (&mut [Row], &mut [Row]) {
        let run = from * self.depth..to * self.depth;
        let (key, owner) = match self.depth {
            1 => (&mut self.floor_key, &mut self.floor_owner),
            _ => (&mut self.key, &mut self.owner),
        };
        (key.get_mut(run.clone()).unwrap_or(&mut []), owner.get_mut(run).unwrap_or(&mut []))
    }

    pub(super) fn depth(&self) -> usize {
        self.depth
    }

    /// (key, owner) of slot `slot` of a beam.
    #[inline(always)]
    pub(super) fn slot(&self, beam: usize, slot: usize) -> (f64, f64) {
        let row = beam / WIDTH * self.depth + slot;
        let (key, owner) = match self.depth {
            1 => (&self.floor_key, &self.floor_owner),
            _ => (&self.key, &self.owner),
        };
        match (key.get(row), owner.get(row)) {
            (Some(key), Some(owner)) => (key.0[beam % WIDTH], owner.0[beam % WIDTH]),
            _ => (0.0, NOBODY),
        }
    }

    /// Enters what ends one beam, if nearer than what does so far.
    #[inline(always)]
    pub(super) fn end_beam(&mut self, beam: usize, key: f64, owner: f64, cos: f64) {
        let (row, place) = (beam / WIDTH, beam % WIDTH);
        let rows = (self.floor_key.get_mut(row), self.floor_owner.get_mut(row), self.floor_cos.get_mut(row));
        if let (Some(keys), Some(owners), Some(cosines)) = rows
            && keys.0[place] < key
        {
            (keys.0[place], owners.0[place], cosines.0[place]) = (key, owner, cos);
        }
    }

    /// |beam · normal| where the floor ends a beam.
    #[inline(always)]
    pub(super) fn cos_of_floor(&self, beam: usize) -> f64 {
        self.floor_cos.get(beam / WIDTH).map_or(0.0, |row| row.0[beam % WIDTH])
    }
}

/// Enters keys where `met` into the slots of eight beams: an insertion network, nearest first.
#[inline(always)]
pub(super) fn insert<S: Simd>(
    part: usize,
    met: Mask<S>,
    key: Lanes<S>,
    owner: Lanes<S>,
    simd: S,
    keys: &mut [Row],
    owners: &mut [Row],
) {
    let (mut key, mut owner) = (met.select(key, Lanes::splat(simd, f64::NEG_INFINITY)), owner);
    for (best, whose) in keys.iter_mut().zip(owners) {
        let (old_key, old_owner) = (best.load(simd, part), whose.load(simd, part));
        let nearer = old_key.lt(key);
        best.store(part, nearer.select(key, old_key));
        whose.store(part, nearer.select(owner, old_owner));
        key = nearer.select(old_key, key);
        owner = nearer.select(old_owner, owner);
    }
}
