//! The caster: what the beams of one mirror turn meet.
//!
//! All beams of a turn lie in one plane across the row, so the scene is cut by the plane once, not asked beam by beam. Organs are
//! sorted along the row (`row_index`); a leaf the plane cuts leaves segments (`leaves`), a branch an interval of beams (`wood`); each
//! enters the beams it covers, the nearest stays (`nearest`). [`brute`] does the same one beam and one organ at a time, by other
//! formulas, and is what the caster is tested against.
//!
//! The conservative intervals may use any arctangent; whether a beam meets an organ is decided by the signs of exact
//! expressions alone, so returns repeat on every machine.

pub mod brute;
mod fan;
mod leaves;
mod nearest;
mod returns;
mod row_index;
mod wood;

pub use fan::BeamFan;
pub use returns::{Class, Return};

use rowscan_protocol::scan::Pose;

use crate::orchard::Orchard;
use leaves::{Label, LeafField};
use nearest::{NOBODY, Nearest};
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
        let Scratch { nearest, crossings } = scratch;
        nearest.reset(fan.len());
        let at = [origin.x_m, self.within_period(origin.y_m), origin.z_m];
        if at.iter().all(|coordinate| coordinate.is_finite()) {
            self.leaves.cast(at, fan, crossings, nearest);
            self.wood.cast(at, fan, self.leaves.len(), nearest);
        }
        for ((target, (inverse, owner)), direction) in
            out.iter_mut().zip(nearest.beams()).zip(fan.directions())
        {
            let organ = self.organ_return(at, direction, inverse, owner);
            let ground = ground_return(at, direction);
            *target = if ground.range_m < organ.range_m { ground } else { organ };
        }
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

    fn organ_return(&self, origin: [f64; 3], direction: (f64, f64), inverse: f64, owner: u32) -> Return {
        if owner == NOBODY {
            return Return::MISS;
        }
        let owner = owner as usize;
        let (class, label, range_m, cos_incidence) = match owner.checked_sub(self.leaves.len()) {
            None => (
                Class::Leaf,
                self.leaves.label(owner),
                1.0 / inverse,
                self.leaves.cos_incidence(owner, direction),
            ),
            Some(entry) => match self.wood.hit(entry, origin, direction) {
                Some(hit) => (Class::Wood, self.wood.label(entry), hit.range_m, hit.cos_incidence),
                None => return Return::MISS,
            },
        };
        let Some(Label { tree, organ }) = label else { return Return::MISS };
        Return { range_m, class, tree, organ, cos_incidence: cos_incidence as f32 }
    }
}

/// The ground, where a beam that looks down meets it.
fn ground_return([_, _, z_m]: [f64; 3], (_, sin): (f64, f64)) -> Return {
    if !(sin < 0.0 && z_m > 0.0) {
        return Return::MISS;
    }
    Return { range_m: z_m / -sin, class: Class::Ground, cos_incidence: -sin as f32, ..Return::MISS }
}
