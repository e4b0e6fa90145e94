//! The middles of which a line's cover does not say that they are hidden on both sides.

use glam::DVec3;
use pulp::Simd;

use super::blades::{Blade, Blades, Depth, HAIR_M, Plane};
use super::cells::{Grid, Sorted};
use super::cover::Cover;
use super::shadow::Shadow;
use crate::lanes::{Lanes, Mask, padded};

/// A half-line starts this far from the leaf, metres.
pub(super) const START_M: f64 = 1e-6;

/// Middles in the order of their cells; every list is [`padded`].
pub(super) struct Open {
    pub(super) sorted: Sorted,
    u: Vec<f64>,
    v: Vec<f64>,
    /// X, Y and Z.
    place: [Vec<f64>; 3],
    /// Whose they are.
    leaf: Vec<f64>,
    /// 1 where another leaf lies ahead, and where one lies behind.
    met: [Vec<f64>; 2],
    /// Of each cell the least deep middle that may be open ahead, and the deepest that may be open behind.
    least: Vec<f64>,
    most: Vec<f64>,
}

impl Open {
    /// Sifts the middles; in `met` stands afterwards whether the cover hides them ahead and behind.
    pub(super) fn new(
        grid: &Grid,
        cover: &Cover,
        plane: &Plane,
        blades: &Blades,
        points: &[(f64, f64)],
        met: &mut [[bool; 2]],
    ) -> Self {
        let (mut least, mut most) = (vec![f64::INFINITY; grid.len()], vec![f64::NEG_INFINITY; grid.len()]);
        let mut open = Vec::new();
        for (((number, blade), point), met) in (0..).zip(&blades.blades).zip(points).zip(met) {
            let cell = grid.cell(*point);
            let (Some(front), Some(back), Some(least), Some(most)) =
                (cover.front.get(cell), cover.back.get(cell), least.get_mut(cell), most.get_mut(cell))
            else {
                continue;
            };
            let depth = blade.middle.dot(plane.direction);
            *met = [depth < back - START_M - HAIR_M, depth > front + START_M + HAIR_M];
            let [ahead, behind] = *met;
            if !ahead {
                *least = least.min(depth);
            }
            if !behind {
                *most = most.max(depth);
            }
            if !(ahead && behind) {
                open.push((number, cell as u32));
            }
        }
        let sorted = Sorted::new(&open, grid.len());
        let list = |value: &dyn Fn(usize) -> f64| {
            padded(sorted.order().iter().map(|n| value(*n as usize)).collect())
        };
        let point = |number: usize| points.get(number).copied().unwrap_or_default();
        let middle = |number: usize| blades.blades.get(number).map_or(DVec3::ZERO, |blade| blade.middle);
        Self {
            u: list(&|number| point(number).0),
            v: list(&|number| point(number).1),
            place: [list(&|n| middle(n).x), list(&|n| middle(n).y), list(&|n| middle(n).z)],
            leaf: list(&|number| number as f64),
            met: [list(&|_| 0.0), list(&|_| 0.0)],
            sorted,
            least: padded(least),
            most: padded(most),
        }
    }

    /// Whether any middle near a leaf may be open to the side where the leaf lies.
    #[inline(always)]
    pub(super) fn faces<S: Simd>(&self, simd: S, grid: &Grid, plane: &Plane, blade: &Blade) -> bool {
        let Depth { near, far } = blade.depth(plane.direction);
        let (near, far) = (Lanes::splat(simd, near), Lanes::splat(simd, far));
        for run in grid.runs(&blade.bounds(plane)) {
            let end = near.of(run.cells.end as f64);
            for at in run.cells.step_by(S::F64_LANES) {
                let (Some(least), Some(most)) =
                    (Lanes::read(simd, &self.least, at), Lanes::read(simd, &self.most, at))
                else {
                    continue;
                };
                let matters = least.le(far).or(near.le(most));
                if !matters.and(Lanes::count_from(simd, at).lt(end)).is_empty() {
                    return true;
                }
            }
        }
        false
    }

    /// What was found of each middle.
    pub(super) fn found(&self) -> impl Iterator<Item = (usize, [bool; 2])> {
        let [ahead, behind] = &self.met;
        let met = ahead.iter().zip(behind).map(|(ahead, behind)| [*ahead > 0.0, *behind > 0.0]);
        self.sorted.order().iter().map(|number| *number as usize).zip(met)
    }
}

/// A leaf that shades.
pub(super) struct Face {
    pub(super) number: f64,
    /// A vertex.
    pub(super) on: DVec3,
    pub(super) normal: DVec3,
    /// normal · direction
    pub(super) facing: f64,
}

impl Face {
    /// Marks the middles of a register from `first` on that lie within the edges, ahead or behind.
    #[inline(always)]
    pub(super) fn ask<S: Simd>(&self, simd: S, shadow: &Shadow, open: &mut Open, first: usize) {
        let Open { u, v, place: [x, y, z], leaf, met: [ahead, behind], .. } = open;
        let (Some(u), Some(v)) = (Lanes::read(simd, u, first), Lanes::read(simd, v, first)) else { return };
        let within = shadow.holds(u, v);
        if within.is_empty() {
            return;
        }
        let (Some(x), Some(y), Some(z), Some(leaf)) = (
            Lanes::read(simd, x, first),
            Lanes::read(simd, y, first),
            Lanes::read(simd, z, first),
            Lanes::read(simd, leaf, first),
        ) else {
            return;
        };
        let (on, normal) = (self.on, self.normal);
        let height = (u.of(on.x) - x) * u.of(normal.x)
            + (u.of(on.y) - y) * u.of(normal.y)
            + (u.of(on.z) - z) * u.of(normal.z);
        let distance = height / u.of(self.facing);
        let other = within.and(leaf.lt(u.of(self.number)).or(u.of(self.number).lt(leaf)));
        mark(simd, ahead, first, other.and(u.of(START_M).lt(distance)));
        mark(simd, behind, first, other.and(distance.lt(u.of(-START_M))));
    }
}

/// Writes 1 to a list, from `first` on, where `met`.
#[inline(always)]
fn mark<S: Simd>(simd: S, list: &mut [f64], first: usize, met: Mask<S>) {
    if let Some(known) = Lanes::read(simd, list, first) {
        met.select(known.of(1.0), known).write(list, first);
    }
}
