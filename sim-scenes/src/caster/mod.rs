//! The caster: what the beams of one mirror turn meet.
//!
//! All beams of a turn lie in one plane across the row, so the scene is cut by the plane once, not asked beam by beam. Organs are
//! sorted along the row (`row_index`); a leaf the plane cuts leaves segments (`leaves`), a branch an interval of beams (`wood`); each
//! enters the beams it covers, the nearest stays (`nearest`). [`brute`] does the same one beam and one organ at a time, by other
//! formulas, and is what the caster is tested against.
//!
//! The conservative intervals may use any arctangent; whether a beam meets an organ is decided by the signs of exact
//! expressions alone, so returns repeat on every machine.

mod alike;
mod beams;
mod block;
pub mod brute;
mod cone;
pub(crate) mod convex;
mod fan;
mod layers;
mod leaf_field;
mod leaf_pass;
mod leaning;
mod leaves;
mod moving;
mod nearest;
mod outlined;
mod parallel;
mod pieces;
mod placed_blocks;
mod range_pass;
mod rectangle;
mod returns;
mod row_index;
mod shapes;
mod sight;
mod spans;
mod tag;
mod template;
mod turned;
mod wood;
mod wood_field;

pub use beams::Beams;
pub use cone::Cone;
pub use fan::BeamFan;
pub use layers::Layers;
pub use parallel::ParallelBeams;
pub use returns::{Class, Return};

use pulp::WithSimd;
use rayon::prelude::*;
use rowscan_protocol::scan::Pose;

use crate::orchard::Orchard;
use block::Block;
use leaf_pass::LeafPass;
use leaning::Leaning;
use nearest::Nearest;
use placed_blocks::{PlacedBlocks, View};
use range_pass::RangePass;
use rectangle::Rectangle;
use sight::{Part, Sight};
use wood::{FloorPass, GroundPass};

/// An orchard made ready for scanning. Immutable and shared between threads; each thread has its own [`Scratch`].
#[derive(Clone, Debug)]
pub struct Caster {
    /// Posts, wires, soil and grass.
    supports: Block,
    /// Height of the level plane under all.
    plane_m: f64,
    /// All trees.
    trees: PlacedBlocks,
    /// What all organs take up across the row, in (X, Z).
    across: Rectangle,
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
    /// The rows and copies that the line may meet.
    views: Vec<View>,
}

impl Caster {
    /// Sorts the orchard's organs along the row; the orchard itself is no longer needed. Memory grows with the distinct trees in
    /// distinct directions, not with their copies.
    pub fn new(orchard: &Orchard) -> Self {
        let period_m = orchard.period_m();
        let trees = PlacedBlocks::new(orchard);
        let built = orchard.supports().iter().flat_map(|support| {
            let (shape, around_m) = (&support.shape, support.shape.radius_m());
            [shape.base(), shape.tip()].map(|at| Rectangle::around(at, around_m))
        });
        let ground = orchard.ground().facets.iter().flat_map(|facet| facet.polygon.outline());
        let ground = ground.map(|vertex| Rectangle::around(*vertex, 0.0));
        Self {
            across: built.chain(ground).fold(trees.across(), Rectangle::and),
            supports: Block::new(std::iter::empty(), orchard.supports(), &orchard.ground().facets, period_m),
            plane_m: orchard.ground().plane_m,
            trees,
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
        match fan.axes() {
            None => self.nearest(origin, fan, fan, scratch, out),
            Some(axes) => self.nearest(origin, &Leaning::new(fan, axes), fan, scratch, out),
        }
    }

    fn nearest<T: Sight>(
        &self,
        origin: Pose,
        sight: &T,
        fan: &BeamFan,
        scratch: &mut Scratch,
        out: &mut [Return],
    ) {
        self.look(origin, sight, 1, scratch);
        let nearest = &scratch.nearest;
        let (ranges, marks) = nearest.slot(0);
        let met = ranges.iter().zip(marks).zip(nearest.cos_of_floor()).zip(fan.directions());
        for ((((range_m, mark), cos), direction), target) in met.zip(out) {
            *target = nearest.owners().tag(*mark).met(*range_m, sight.in_scene(direction), *cos);
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
    /// `out` is emptied first and reused. With `k` = 0 only the nearest surface is kept. Of a plane that leans, a leaf that reaches over the
    /// end of the row's period counts twice.
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
            Beams::Fan(fan) => match fan.axes() {
                None => self.layers(origin, fan, k, scratch, out),
                Some(axes) => self.layers(origin, &Leaning::new(fan, axes), k, scratch, out),
            },
            Beams::Parallel(beams) => self.layers(origin, beams, k, scratch, out),
        }
    }

    fn layers<T: Sight>(&self, origin: Pose, sight: &T, k: usize, scratch: &mut Scratch, out: &mut Layers) {
        let depth = k.max(1);
        self.look(origin, sight, depth, scratch);
        let nearest = &scratch.nearest;
        for (beam, cos) in (0..sight.count()).zip(nearest.cos_of_floor()) {
            let slots = (0..depth).filter_map(|slot| nearest.at(slot, beam));
            let direction = sight.in_scene(sight.direction(beam));
            out.set(
                beam,
                slots.map(|(range_m, mark)| nearest.owners().tag(mark).met(range_m, direction, *cos)),
            );
        }
    }

    /// Fills the scratch with what every beam meets.
    fn look<T: Sight>(&self, origin: Pose, sight: &T, depth: usize, scratch: &mut Scratch) {
        let Scratch { nearest, facets, views } = scratch;
        nearest.reset(sight.count(), depth, T::FARTHEST);
        let parts = self.parts(origin, sight).flat_map(|part| self.images(part, sight));
        if let Some(part) = parts.clone().next() {
            self.dispatch(GroundPass { sight, part, plane_m: self.plane_m, nearest: &mut *nearest });
        }
        views.clear();
        for part in parts {
            self.floor(&self.supports, sight, part, None, nearest, facets);
            self.trees.seen(part, views);
        }
        PlacedBlocks::order(views);
        let mut first = true;
        for View { block, tree, part, window, beyond } in views.iter() {
            let Some(block) = self.trees.block(*block) else { continue };
            let part = &Part { y_m: sight.reach(part.starts_m, *window), ..*part };
            if first {
                self.floor(block, sight, *part, *tree, nearest, facets);
                nearest.close_floor();
                first = false;
            } else if sight.is_hidden(*beyond, nearest) {
                // Nor is anything behind it to be seen.
                break;
            } else if sight.is_hidden(*window, nearest) {
                continue;
            } else {
                self.floor(block, sight, *part, *tree, nearest, facets);
                nearest.lower_floor();
            }
            self.leaves(block, sight, *part, *tree, nearest);
        }
        if first {
            nearest.close_floor();
        }
        self.dispatch(RangePass::<T>::of(nearest));
    }

    /// Enters what ends beams: branches, posts, wires, facets.
    fn floor<T: Sight>(
        &self,
        block: &Block,
        sight: &T,
        part: Part,
        copy: Option<u32>,
        nearest: &mut Nearest,
        facets: &mut Nearest,
    ) {
        self.dispatch(FloorPass { field: &block.wood, sight, part, copy, nearest });
        if !block.facets.is_empty() {
            facets.open_on(nearest);
            for field in &block.facets {
                self.dispatch(LeafPass { field, sight, part, copy, nearest: facets });
            }
            nearest.take_floor(facets);
        }
    }

    /// Enters leaves before the floor.
    fn leaves<T: Sight>(
        &self,
        block: &Block,
        sight: &T,
        part: Part,
        copy: Option<u32>,
        nearest: &mut Nearest,
    ) {
        for field in &block.leaves {
            self.dispatch(LeafPass { field, sight, part, copy, nearest });
        }
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
            let starts_m = (one.min(other), one.max(other));
            Some(Part { origin: [x_m, first_m - shift, z_m], beams: (from, beyond), starts_m, y_m: starts_m })
        })
    }

    /// A part as every period of the row sees it that its beams may meet something in: of a level plane itself alone.
    fn images<'a, T: Sight>(
        &'a self,
        part: Part,
        sight: &T,
    ) -> impl Iterator<Item = Part> + Clone + use<'a, T> {
        let [x_m, first_m, z_m] = part.origin;
        let Rectangle { low, high } = self.across;
        let across = Rectangle { low: [low[0] - x_m, low[1] - z_m], high: [high[0] - x_m, high[1] - z_m] };
        let (low_m, high_m) = sight.reach(part.starts_m, across);
        let periods = if T::LEANS && self.period_m.is_finite() {
            (low_m / self.period_m).floor().min(0.0) as i64..=(high_m / self.period_m).floor().max(0.0) as i64
        } else {
            0..=0
        };
        periods.map(move |period| {
            let shift_m = if period == 0 { 0.0 } else { period as f64 * self.period_m };
            Part {
                origin: [x_m, first_m - shift_m, z_m],
                starts_m: (part.starts_m.0 - shift_m, part.starts_m.1 - shift_m),
                y_m: (low_m - shift_m, high_m - shift_m),
                beams: part.beams,
            }
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
}
