//! The caster: what the beams of one mirror turn meet.
//!
//! All beams of a turn lie in one plane across the row, so the scene is cut by the plane once, not asked beam by beam. Organs are
//! sorted along the row (`row_index`); a leaf the plane cuts leaves segments (`leaves`), a branch an interval of beams (`wood`); each
//! enters the beams it covers, the nearest stays (`nearest`). [`brute`] does the same one beam and one organ at a time, by other
//! formulas, and is what the caster is tested against.
//!
//! The conservative intervals may use any arctangent; whether a beam meets an organ is decided by the signs of exact
//! expressions alone, so returns repeat on every machine.

mod beams;
pub mod brute;
mod fan;
mod layers;
mod leaves;
mod nearest;
mod returns;
mod row_index;
mod sight;
mod wood;

pub use beams::{Beams, ParallelBeams};
pub use fan::BeamFan;
pub use layers::Layers;
pub use returns::{Class, Return};

use glam::DVec3;
use rowscan_protocol::scan::Pose;

use crate::orchard::Orchard;
use leaves::{Label, LeafField};
use nearest::{NOBODY, Nearest};
use sight::Sight;
use wood::WoodField;

/// An orchard made ready for scanning. Immutable and shared between threads; each thread has its own [`Scratch`].
#[derive(Clone, Debug)]
pub struct Caster {
    leaves: LeafField,
    wood: WoodField,
    period_m: f64,
}

/// Working memory of one thread, reused from line to line.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    nearest: Nearest,
    crossings: Vec<(f64, f64)>,
}

impl Caster {
    /// Sorts the orchard's organs along the row; the orchard itself is no longer needed.
    pub fn new(orchard: &Orchard) -> Self {
        let period_m = orchard.length_m();
        let trees = || (0..).zip(orchard.trees());
        let leaves = trees().flat_map(|(tree, organs)| {
            (0..).zip(&organs.leaves).map(move |(organ, leaf)| (Label { tree, organ }, leaf))
        });
        let wood = trees().flat_map(|(tree, organs)| {
            (0..).zip(&organs.wood).map(move |(organ, piece)| (Label { tree, organ }, piece))
        });
        Self { leaves: LeafField::new(leaves, period_m), wood: WoodField::new(wood, period_m), period_m }
    }

    /// The nearest surface along every beam of `fan` from `origin`, all within the plane y = origin.y: leaf, wood, or the ground
    /// Z = 0 beyond neither. Writes one return a beam, as many as both `fan` and `out` hold.
    ///
    /// The origin may be anywhere, also far along the row (which repeats), above it, or within the canopy. An origin that is not a
    /// number meets nothing.
    pub fn cast(&self, origin: Pose, fan: &BeamFan, scratch: &mut Scratch, out: &mut [Return]) {
        let at = self.look(origin, fan, 1, scratch);
        for (beam, target) in (0..fan.len()).zip(out) {
            *target = self.found(at, fan, beam, scratch).next().unwrap_or(Return::MISS);
        }
    }

    /// The nearest surface along every beam, as [`Caster::cast`] finds it, and besides the first `k` leaves before the first wood and
    /// the ground (three for the I_3L of the paper), each with its own range, labels and incidence; in one pass.
    ///
    /// `out` is emptied first and reused. With `k` = 0 only the nearest surface is kept.
    pub fn cast_layers(
        &self,
        origin: Pose,
        beams: &Beams,
        k: usize,
        scratch: &mut Scratch,
        out: &mut Layers,
    ) {
        out.reset(beams.len(), k);
        match beams {
            Beams::Fan(fan) => self.layers(origin, fan, k, scratch, out),
            Beams::Parallel(beams) => self.layers(origin, beams, k, scratch, out),
        }
    }

    fn layers<S: Sight>(&self, origin: Pose, sight: &S, k: usize, scratch: &mut Scratch, out: &mut Layers) {
        let at = self.look(origin, sight, k.max(1), scratch);
        for beam in 0..sight.count() {
            out.set(beam, self.found(at, sight, beam, scratch));
        }
    }

    /// Fills the scratch with what every beam meets; gives the place looked from, within the period.
    fn look<S: Sight>(&self, origin: Pose, sight: &S, depth: usize, scratch: &mut Scratch) -> DVec3 {
        let Scratch { nearest, crossings } = scratch;
        nearest.reset(sight.count(), depth, S::FARTHEST);
        let at = [origin.x_m, self.within_period(origin.y_m), origin.z_m];
        if at.iter().all(|coordinate| coordinate.is_finite()) {
            self.wood.cast(at, sight, self.leaves.len(), nearest);
            self.leaves.cast(at, sight, crossings, nearest);
        }
        DVec3::from_array(at)
    }

    /// What a beam met, nearest first: the leaves up to the first other surface, and that.
    fn found<S: Sight>(
        &self,
        at: DVec3,
        sight: &S,
        beam: usize,
        scratch: &Scratch,
    ) -> impl Iterator<Item = Return> {
        let (start, direction) = sight.ray(beam);
        let start = at + start;
        let ground = ground_return(start, direction);
        let mut ended = false;
        scratch.nearest.beam(beam).map_while(move |(key, owner)| {
            let organ = self.organ_return(start, direction, S::range_m(key), owner);
            let hit = if ground.range_m < organ.range_m { ground } else { organ };
            let show = !ended;
            ended |= hit.class != Class::Leaf;
            show.then_some(hit)
        })
    }

    /// The same place of the row, in [0, period).
    fn within_period(&self, y_m: f64) -> f64 {
        if !self.period_m.is_finite() {
            return y_m;
        }
        let wrapped = y_m.rem_euclid(self.period_m);
        // The remainder of a tiny negative number rounds up to the period itself.
        if wrapped < self.period_m { wrapped } else { 0.0 }
    }

    fn organ_return(&self, start: DVec3, direction: DVec3, range_m: f64, owner: u32) -> Return {
        if owner == NOBODY {
            return Return::MISS;
        }
        let owner = owner as usize;
        let (class, label, range_m, cos_incidence) = match owner.checked_sub(self.leaves.len()) {
            None => {
                (Class::Leaf, self.leaves.label(owner), range_m, self.leaves.cos_incidence(owner, direction))
            }
            Some(entry) => match self.wood.hit(entry, start, direction) {
                Some(hit) => (Class::Wood, self.wood.label(entry), hit.range_m, hit.cos_incidence),
                None => return Return::MISS,
            },
        };
        let Some(Label { tree, organ }) = label else { return Return::MISS };
        Return { range_m, class, tree, organ, cos_incidence: cos_incidence as f32 }
    }
}

/// The ground, where a beam that looks down meets it.
fn ground_return(start: DVec3, direction: DVec3) -> Return {
    if !(direction.z < 0.0 && start.z > 0.0) {
        return Return::MISS;
    }
    Return {
        range_m: start.z / -direction.z,
        class: Class::Ground,
        cos_incidence: -direction.z as f32,
        ..Return::MISS
    }
}
