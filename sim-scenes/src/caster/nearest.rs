//! What every beam of a line has met nearest so far.

use pulp::Simd;

use super::tag::Tag;
use crate::lanes::{Lanes, Mask, WIDTH};

/// The owner of a beam that met nothing.
const NOBODY: usize = 0;

/// The owner of a beam that met the ground.
pub(super) const GROUND: usize = 1;

/// An owner's number as it is kept beside the keys: by its bits, which registers of f64 select and store as they are.
#[inline(always)]
pub(super) fn marked(owner: usize) -> f64 {
    f64::from_bits(owner as u64)
}

/// The largest depth keys and whose they are, beam by beam, in slots, nearest first. Surfaces that end a beam (wood, ground) are the
/// floor: they fill all slots, so that no leaf behind them enters. Where there is one slot, it is the floor's own.
///
/// Lists are a little longer than the line has beams: registers are read and written from any beam on.
#[derive(Clone, Debug, Default)]
pub(super) struct Nearest {
    depth: usize,
    beams: usize,
    /// One list a slot, if more than one.
    key: Vec<f64>,
    owner: Vec<f64>,
    /// What ends each beam, and |beam · normal| there.
    floor_key: Vec<f64>,
    floor_owner: Vec<f64>,
    floor_cos: Vec<f64>,
    owners: Owners,
}

/// What the owners of a line are: nobody, the ground, and the organs that the line came upon, in its order.
#[derive(Clone, Debug, Default)]
pub(super) struct Owners(Vec<Tag>);

impl Owners {
    fn reset(&mut self) {
        self.0.clear();
        self.0.extend([Tag::NOTHING, Tag::GROUND]);
    }

    /// The number of what is listed next.
    #[inline(always)]
    pub(super) fn next(&self) -> usize {
        self.0.len()
    }

    /// Lists organs, of tree `copy` if they are a copy's. Gives the first one's number.
    #[inline(always)]
    pub(super) fn list(&mut self, tags: &[Tag], copy: Option<u32>) -> usize {
        let first = self.0.len();
        self.0.extend_from_slice(tags);
        if let Some(tree) = copy {
            self.0.iter_mut().skip(first).for_each(|tag| tag.label.tree = tree);
        }
        first
    }

    /// What an owner is.
    #[inline(always)]
    pub(super) fn tag(&self, mark: f64) -> &Tag {
        self.0.get(mark.to_bits() as usize).unwrap_or(&Tag::NOTHING)
    }
}

impl Nearest {
    /// Forgets everything, for `beams` beams. Allocates only where a line is longer than any before.
    pub(super) fn reset(&mut self, beams: usize, depth: usize, farthest: f64) {
        (self.beams, self.depth) = (beams, depth);
        self.owners.reset();
        for (list, value) in [
            (&mut self.floor_key, farthest),
            (&mut self.floor_owner, marked(NOBODY)),
            (&mut self.floor_cos, 0.0),
        ] {
            list.clear();
            list.resize(beams + WIDTH, value);
        }
    }

    /// The floor is complete; leaves come now.
    pub(super) fn close_floor(&mut self) {
        if self.depth == 1 {
            return;
        }
        for (slots, floor) in [(&mut self.key, &self.floor_key), (&mut self.owner, &self.floor_owner)] {
            slots.clear();
            for _ in 0..self.depth {
                slots.extend_from_slice(floor);
            }
        }
    }

    /// The floor has risen since it was closed: what lies behind it goes.
    pub(super) fn lower_floor(&mut self) {
        if self.depth == 1 {
            return;
        }
        let places = self.places();
        let slots = self.key.chunks_exact_mut(places).zip(self.owner.chunks_exact_mut(places));
        for (keys, owners) in slots {
            let floor = self.floor_key.iter().zip(&self.floor_owner);
            for ((key, owner), (floor, whose)) in keys.iter_mut().zip(owners).zip(floor) {
                if *key < *floor {
                    (*key, *owner) = (*floor, *whose);
                }
            }
        }
    }

    /// Starts over with one slot a beam, which holds the floor of `other`, and takes its owners over until
    /// [`Nearest::take_floor`].
    pub(super) fn open_on(&mut self, other: &mut Self) {
        (self.beams, self.depth) = (other.beams, 1);
        std::mem::swap(&mut self.owners, &mut other.owners);
        self.floor_key.clone_from(&other.floor_key);
        self.floor_owner.clone_from(&other.floor_owner);
    }

    /// Makes the slots of `other` the floor. Where they are polygons, the cosine is theirs and not the floor's.
    pub(super) fn take_floor(&mut self, other: &mut Self) {
        std::mem::swap(&mut self.floor_key, &mut other.floor_key);
        std::mem::swap(&mut self.floor_owner, &mut other.floor_owner);
        std::mem::swap(&mut self.owners, &mut other.owners);
    }

    /// True if every beam from `low` to `high` has its last slot filled by something with a greater key than `key`.
    pub(super) fn all_nearer(&self, (low, high): (usize, usize), key: f64) -> bool {
        let (keys, _) = self.slot(self.depth.saturating_sub(1));
        keys.get(low..=high).is_some_and(|keys| keys.iter().all(|nearest| *nearest > key))
    }

    /// Length of a list.
    /// All depth keys, as the line is padded.
    pub(super) fn keys_mut(&mut self) -> &mut [f64] {
        if self.depth == 1 { &mut self.floor_key } else { &mut self.key }
    }

    fn places(&self) -> usize {
        self.beams + WIDTH
    }

    pub(super) fn depth(&self) -> usize {
        self.depth
    }

    /// What branches and the ground are entered into, and what lists them: `places` places.
    #[inline(always)]
    pub(super) fn floor(&mut self, places: usize) -> Option<(Floor<'_>, &mut Owners)> {
        let floor = Floor {
            keys: self.floor_key.get_mut(..places)?,
            owners: self.floor_owner.get_mut(..places)?,
            cosines: self.floor_cos.get_mut(..places)?,
        };
        Some((floor, &mut self.owners))
    }

    /// What leaves are entered into, and what lists them. Lists are cut to `places` a slot, so that one look at a place is enough for all.
    #[inline(always)]
    pub(super) fn slots(&mut self, places: usize, depth: usize) -> Option<(Slots<'_>, &mut Owners)> {
        let (keys, owners) = match self.depth {
            1 => (&mut self.floor_key, &mut self.floor_owner),
            _ => (&mut self.key, &mut self.owner),
        };
        let (keys, owners) = (keys.get_mut(..places * depth)?, owners.get_mut(..places * depth)?);
        Some((Slots { keys, owners, places }, &mut self.owners))
    }

    pub(super) fn owners(&self) -> &Owners {
        &self.owners
    }

    /// Keys and owners of slot `slot`, beam by beam.
    pub(super) fn slot(&self, slot: usize) -> (&[f64], &[f64]) {
        let list = slot * self.places()..slot * self.places() + self.beams;
        let (keys, owners) = match self.depth {
            1 => (&self.floor_key, &self.floor_owner),
            _ => (&self.key, &self.owner),
        };
        (keys.get(list.clone()).unwrap_or(&[]), owners.get(list).unwrap_or(&[]))
    }

    /// Key and owner of slot `slot` of a beam.
    #[inline(always)]
    pub(super) fn at(&self, slot: usize, beam: usize) -> Option<(f64, f64)> {
        let (keys, owners) = self.slot(slot);
        Some((*keys.get(beam)?, *owners.get(beam)?))
    }

    /// |beam · normal| where the floor ends each beam.
    pub(super) fn cos_of_floor(&self) -> &[f64] {
        &self.floor_cos
    }
}

/// What ends beams, a place for each.
pub(super) struct Floor<'a> {
    keys: &'a mut [f64],
    owners: &'a mut [f64],
    cosines: &'a mut [f64],
}

impl Floor<'_> {
    /// Enters what ends beams, from beam `beam` on, where `met` and nearer than what does so far.
    #[inline(always)]
    pub(super) fn end<S: Simd>(
        &mut self,
        simd: S,
        beam: usize,
        met: Mask<S>,
        key: Lanes<S>,
        owner: f64,
        cos: Lanes<S>,
    ) {
        let (Some(old), Some(whose), Some(cosines)) = (
            Lanes::read(simd, self.keys, beam),
            Lanes::read(simd, self.owners, beam),
            Lanes::read(simd, self.cosines, beam),
        ) else {
            return;
        };
        let nearer = met.and(old.lt(key));
        nearer.select(key, old).write(self.keys, beam);
        nearer.select(Lanes::splat(simd, owner), whose).write(self.owners, beam);
        nearer.select(cos, cosines).write(self.cosines, beam);
    }
}

/// Slots of all beams: `places` places a slot.
pub(super) struct Slots<'a> {
    keys: &'a mut [f64],
    owners: &'a mut [f64],
    places: usize,
}

impl Slots<'_> {
    /// Enters keys from beam `beam` on where `met` into the first `depth` slots: an insertion network, nearest first.
    #[inline(always)]
    pub(super) fn insert<S: Simd>(
        &mut self,
        simd: S,
        beam: usize,
        depth: usize,
        met: Mask<S>,
        key: Lanes<S>,
        owner: f64,
    ) {
        let mut key = met.select(key, Lanes::splat(simd, f64::NEG_INFINITY));
        let mut owner = Lanes::splat(simd, owner);
        for slot in 0..depth {
            let place = slot * self.places + beam;
            let (Some(old_key), Some(old_owner)) =
                (Lanes::read(simd, self.keys, place), Lanes::read(simd, self.owners, place))
            else {
                return;
            };
            let nearer = old_key.lt(key);
            nearer.select(key, old_key).write(self.keys, place);
            nearer.select(owner, old_owner).write(self.owners, place);
            key = nearer.select(old_key, key);
            owner = nearer.select(old_owner, owner);
        }
    }
}
