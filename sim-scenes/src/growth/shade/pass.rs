//! Whom each leaf shades along one line: all are projected along it, and each asks the middles within its outline, eight at a time.

use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

use super::cells::{Bounds, Cells};
use crate::growth::rotation::square_to;
use crate::lanes::{Lanes, Mask, padded};
use crate::organ::Leaf;

/// A half-line starts this far from the leaf, metres.
pub(super) const START_M: f64 = 1e-6;

/// A leaf seen more edge-on than this hides nothing.
pub(super) const EDGE_ON: f64 = 1e-12;

/// For every leaf, whether another one lies ahead of and behind its centroid along `direction`.
pub(super) fn hidden(direction: DVec3, leaves: &[&Leaf], centroids: &[DVec3]) -> Vec<[bool; 2]> {
    let plane = Plane::square_to(direction);
    let points: Vec<(f64, f64)> = centroids.iter().map(|centroid| plane.flat(*centroid)).collect();
    let outlines = leaves.iter().map(|leaf| Bounds::of(leaf.outline().iter().map(|v| plane.flat_of(v))));
    let heights: f64 = outlines.map(|bounds| bounds.high.1 - bounds.low.1).sum();
    // About half as large as the leaves: they ask few middles beside their own, in few runs.
    let (cells, order) = Cells::new(&points, heights / leaves.len().max(1) as f64 / 2.0);
    let sorted = |value: &dyn Fn(usize) -> f64| padded(order.iter().map(|number| value(*number)).collect());
    let middle = |number: usize| centroids.get(number).copied().unwrap_or_default();
    let mut middles = Middles {
        u: sorted(&|number| points.get(number).map_or(f64::INFINITY, |point| point.0)),
        v: sorted(&|number| points.get(number).map_or(f64::INFINITY, |point| point.1)),
        place: [sorted(&|n| middle(n).x), sorted(&|n| middle(n).y), sorted(&|n| middle(n).z)],
        leaf: sorted(&|number| number as f64),
        met: [vec![0.0; order.len()], vec![0.0; order.len()]].map(padded),
    };
    Arch::new().dispatch(ShadePass { plane, leaves, cells: &cells, middles: &mut middles });
    let mut hidden = vec![[false; 2]; leaves.len()];
    let [ahead, behind] = &middles.met;
    for ((number, ahead), behind) in order.iter().zip(ahead).zip(behind) {
        if let Some(met) = hidden.get_mut(*number) {
            *met = [*ahead > 0.0, *behind > 0.0];
        }
    }
    hidden
}

/// A plane square to a direction.
#[derive(Clone, Copy)]
struct Plane {
    direction: DVec3,
    u: DVec3,
    v: DVec3,
}

impl Plane {
    fn square_to(direction: DVec3) -> Self {
        let u = square_to(direction);
        Self { direction, u, v: direction.cross(u) }
    }

    fn flat(&self, point: DVec3) -> (f64, f64) {
        (point.dot(self.u), point.dot(self.v))
    }

    fn flat_of(&self, vertex: &[f64; 3]) -> (f64, f64) {
        self.flat(DVec3::from_array(*vertex))
    }
}

/// The middles of all leaves, in the order of their cells; every list is [`padded`].
struct Middles {
    u: Vec<f64>,
    v: Vec<f64>,
    /// X, Y and Z.
    place: [Vec<f64>; 3],
    /// Whose they are.
    leaf: Vec<f64>,
    /// 1 where another leaf lies ahead, and where one lies behind.
    met: [Vec<f64>; 2],
}

/// An edge of a projected outline.
#[derive(Clone, Copy)]
struct Edge {
    from: (f64, f64),
    to_v: f64,
    /// How far u goes for each v.
    slope: f64,
}

/// Marks the middles that lie before and behind any other leaf.
struct ShadePass<'a> {
    plane: Plane,
    leaves: &'a [&'a Leaf],
    cells: &'a Cells,
    middles: &'a mut Middles,
}

impl WithSimd for ShadePass<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { plane, leaves, cells, middles } = self;
        let (mut outline, mut edges) = (Vec::new(), Vec::new());
        for (number, leaf) in leaves.iter().enumerate() {
            let normal = DVec3::from_array(leaf.normal());
            let facing = normal.dot(plane.direction);
            let Some(on) = leaf.outline().first().filter(|_| facing.abs() >= EDGE_ON) else { continue };
            outline.clear();
            outline.extend(leaf.outline().iter().map(|vertex| plane.flat_of(vertex)));
            edges.clear();
            let mut from = outline.last().copied().unwrap_or_default();
            for &to in &outline {
                edges.push(Edge { from, to_v: to.1, slope: (to.0 - from.0) / (to.1 - from.1) });
                from = to;
            }
            let face = Face { number: number as f64, on: *on, normal: normal.to_array(), facing };
            for run in cells.runs(Bounds::of(outline.iter().copied())) {
                for first in run.step_by(S::F64_LANES) {
                    face.ask(simd, &edges, middles, first);
                }
            }
        }
    }
}

/// A leaf that shades.
struct Face {
    number: f64,
    /// A vertex.
    on: [f64; 3],
    normal: [f64; 3],
    /// normal · direction
    facing: f64,
}

impl Face {
    /// Marks the middles of a register from `first` on that lie within the edges, ahead or behind.
    #[inline(always)]
    fn ask<S: Simd>(&self, simd: S, edges: &[Edge], middles: &mut Middles, first: usize) {
        let Middles { u, v, place: [x, y, z], leaf, met: [ahead, behind] } = middles;
        let (Some(u), Some(v)) = (Lanes::read(simd, u, first), Lanes::read(simd, v, first)) else { return };
        // Even-odd rule in the projection; each edge owns its lower end.
        let mut within = u.lt(u);
        for Edge { from, to_v, slope } in edges {
            let (from_u, from_v) = (u.of(from.0), u.of(from.1));
            let crossed = v.lt(from_v).xor(v.lt(u.of(*to_v)));
            within = within.xor(crossed.and(u.lt(from_u + (v - from_v) * u.of(*slope))));
        }
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
        let ([on_x, on_y, on_z], [normal_x, normal_y, normal_z]) = (self.on, self.normal);
        let height = (u.of(on_x) - x) * u.of(normal_x)
            + (u.of(on_y) - y) * u.of(normal_y)
            + (u.of(on_z) - z) * u.of(normal_z);
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
