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
mod block;
pub mod brute;
pub(crate) mod convex;
mod fan;
mod lanes;
mod layers;
mod leaves;
mod moving;
mod nearest;
mod parallel;
mod returns;
mod row_index;
mod sight;
mod standing;
mod wood;

pub use beams::Beams;
pub use fan::BeamFan;
pub use layers::Layers;
pub use parallel::ParallelBeams;
pub use returns::{Class, Return};

use glam::DVec3;
use pulp::WithSimd;
use rayon::prelude::*;
use rowscan_protocol::scan::Pose;

use crate::orchard::Orchard;
use block::{Block, Found};
use leaves::LeafPass;
use nearest::{GROUND, NOBODY, Nearest};
use sight::{Part, Sight};
use standing::{Standing, View};
use wood::{FloorPass, GroundPass};

/// An orchard made ready for scanning. Immutable and shared between threads; each thread has its own [`Scratch`].
#[derive(Clone, Debug)]
pub struct Caster {
    /// All trees that stand where they were made, and posts and wires.
    row: Block,
    /// Copies of distinct trees.
    standing: Standing,
    period_m: f64,
    registers: Registers,
}

/// Which registers the kernels use. Returns are the same to the last bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Registers {
    /// The widest this machine has, found out at run time.
    #[default]
    Widest,
    /// One number at a time.
    Single,
}

/// Working memory of one thread, reused from line to line.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    nearest: Nearest,
    /// The nearest facets, before they become part of the floor.
    facets: Nearest,
    /// The copies that the line may meet.
    views: Vec<View>,
}

impl Caster {
    /// Sorts the orchard's organs along the row; the orchard itself is no longer needed. Memory grows with the distinct trees in
    /// distinct directions, not with their copies.
    pub fn new(orchard: &Orchard) -> Self {
        let period_m = orchard.length_m();
        let here = orchard
            .standing()
            .map(|(tree, placement)| orchard.distinct_trees().get(tree).filter(|_| placement.is_here()));
        let here = (0..).zip(here).filter_map(|(number, tree)| Some((number, tree?)));
        Self {
            row: Block::new(here, orchard.supports(), period_m),
            standing: Standing::new(orchard),
            period_m,
            registers: Registers::Widest,
        }
    }

    /// The same caster with other registers.
    #[must_use]
    pub fn with_registers(self, registers: Registers) -> Self {
        Self { registers, ..self }
    }

    /// The nearest surface along every beam of `fan` from `origin` (beam 0's start, if the scanner moves): leaf, wood, or the ground
    /// Z = 0 beyond neither. Writes one return a beam, as many as both `fan` and `out` hold.
    ///
    /// The origin may be anywhere, also far along the row (which repeats), above it, or within the canopy. An origin that is not a
    /// number meets nothing.
    pub fn cast(&self, origin: Pose, fan: &BeamFan, scratch: &mut Scratch, out: &mut [Return]) {
        self.look(origin, fan, 1, scratch);
        for ((beam, direction), target) in fan.directions().enumerate().zip(out) {
            *target = self.found(fan, DVec3::new(direction.0, 0.0, direction.1), beam, 0, scratch);
        }
    }

    /// Many lines, on all threads of the current rayon pool: line `i` from `origins[i]` goes to `out[i · fan.len()..]`. The returns are
    /// those of [`Caster::cast`], whatever the number of threads. Lines for which `out` has no room are left out.
    pub fn cast_lines(&self, origins: &[Pose], fan: &BeamFan, out: &mut [Return]) {
        let lines = out.par_chunks_exact_mut(fan.len().max(1)).zip(origins);
        lines.for_each_init(Scratch::default, |scratch, (line, origin)| {
            self.cast(*origin, fan, scratch, line)
        });
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

    fn layers<T: Sight>(&self, origin: Pose, sight: &T, k: usize, scratch: &mut Scratch, out: &mut Layers) {
        let depth = k.max(1);
        self.look(origin, sight, depth, scratch);
        for beam in 0..sight.count() {
            let (_, direction) = sight.ray(beam);
            out.set(beam, (0..depth).map(|slot| self.found(sight, direction, beam, slot, scratch)));
        }
    }

    /// Fills the scratch with what every beam meets.
    fn look<T: Sight>(&self, origin: Pose, sight: &T, depth: usize, scratch: &mut Scratch) {
        let Scratch { nearest, facets, views } = scratch;
        nearest.reset(sight.parameters().0.len(), depth, T::FARTHEST);
        let parts = self.parts(origin, sight);
        for part in parts.clone() {
            self.dispatch(GroundPass { sight, part, nearest: &mut *nearest });
            self.floor(&self.row, sight, part, 0, nearest, facets);
        }
        nearest.close_floor();
        views.clear();
        for part in parts {
            self.leaves(&self.row, sight, part, 0, nearest);
            self.standing.seen(part, views);
        }
        if views.is_empty() {
            return;
        }
        self.standing.order(views, self.row.len());
        for view in views.iter() {
            if sight.is_hidden(view.beyond, nearest) {
                // Nor is anything behind it to be seen.
                break;
            }
            let Some(block) =
                self.standing.block(view.block).filter(|_| !sight.is_hidden(view.window, nearest))
            else {
                continue;
            };
            self.floor(block, sight, view.part, view.first_owner, nearest, facets);
            nearest.lower_floor();
            self.leaves(block, sight, view.part, view.first_owner, nearest);
        }
    }

    /// Enters what ends beams: branches, posts, wires, facets.
    fn floor<T: Sight>(
        &self,
        block: &Block,
        sight: &T,
        part: Part,
        first_owner: usize,
        nearest: &mut Nearest,
        facets: &mut Nearest,
    ) {
        let (wood, polygons) = block.borders();
        let floor = first_owner + wood;
        self.dispatch(FloorPass { field: &block.wood, sight, part, first_owner: floor, nearest });
        if block.facets.len() > 0 {
            facets.open_on(nearest);
            let first_owner = first_owner + polygons;
            self.dispatch(LeafPass { field: &block.facets, sight, part, first_owner, nearest: facets });
            nearest.take_floor(facets);
        }
    }

    /// Enters leaves before the floor.
    fn leaves<T: Sight>(
        &self,
        block: &Block,
        sight: &T,
        part: Part,
        first_owner: usize,
        nearest: &mut Nearest,
    ) {
        self.dispatch(LeafPass { field: &block.leaves, sight, part, first_owner, nearest });
    }

    /// A line by periods of the row: one part, unless a moving scanner passes the end of a period. None where the origin is no number.
    fn parts<T: Sight>(&self, origin: Pose, sight: &T) -> impl Iterator<Item = Part> + Clone {
        let (count, advance_m) = (sight.count(), sight.advance_m());
        let Pose { x_m, y_m, z_m } = origin;
        let first_m = self.within_period(y_m);
        let (period_m, endless) = (self.period_m, self.period_m.is_finite());
        let at = move |beam: usize| first_m + beam as f64 * advance_m;
        let usable = [x_m, first_m, z_m].iter().all(|coordinate| coordinate.is_finite());
        let mut next = if usable { 0 } else { count };
        std::iter::from_fn(move || {
            let from = next;
            if from >= count {
                return None;
            }
            let period = |beam: usize| if endless { (at(beam) / period_m).floor() } else { 0.0 };
            let here = period(from);
            // The first beam of another period: they come in order.
            let (mut to, mut beyond) = (from, count);
            while to + 1 < beyond {
                let middle = to + (beyond - to) / 2;
                if period(middle) == here { to = middle } else { beyond = middle }
            }
            next = beyond;
            let shift = here * if endless { period_m } else { 0.0 };
            let (one, other) = (at(from) - shift, at(beyond - 1) - shift);
            Some(Part {
                origin: [x_m, first_m - shift, z_m],
                beams: (from, beyond),
                y_m: (one.min(other), one.max(other)),
            })
        })
    }

    fn dispatch(&self, pass: impl WithSimd<Output = ()>) {
        match self.registers {
            Registers::Widest => pulp::Arch::new().dispatch(pass),
            Registers::Single => pass.with_simd(pulp::Scalar::new()),
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

    /// What slot `slot` of a beam holds.
    #[inline(always)]
    fn found<T: Sight>(
        &self,
        _: &T,
        direction: DVec3,
        beam: usize,
        slot: usize,
        scratch: &Scratch,
    ) -> Return {
        let (key, owner) = scratch.nearest.slot(beam, slot);
        if owner == NOBODY {
            return Return::MISS;
        }
        let range_m = T::range_m(key);
        let on_floor = |class, tree, organ| {
            let cos_incidence = scratch.nearest.cos_of_floor(beam) as f32;
            Return { range_m, class, tree, organ, cos_incidence }
        };
        if owner == GROUND {
            return on_floor(Class::Ground, Return::NO_LABEL, Return::NO_LABEL);
        }
        let entry = owner as usize;
        // Organs of the row carry their trees' numbers; those of a copy are the copy's.
        let (found, copy) = match entry.checked_sub(self.row.len()) {
            None => (self.row.found(entry, direction), None),
            Some(_) => {
                let view = scratch.views.partition_point(|view| view.first_owner <= entry).wrapping_sub(1);
                let Some(view) = scratch.views.get(view) else { return Return::MISS };
                let block = self.standing.block(view.block);
                (block.and_then(|block| block.found(entry - view.first_owner, direction)), Some(view.tree))
            }
        };
        match found {
            None => Return::MISS,
            Some(Found::Cylinder(class, label)) => on_floor(class, copy.unwrap_or(label.tree), label.organ),
            Some(Found::Polygon(class, label, cos_incidence)) => {
                let tree = copy.unwrap_or(label.tree);
                Return { range_m, class, tree, organ: label.organ, cos_incidence }
            }
        }
    }
}
