//! Leaves in the axes of a plane that leans.

use pulp::Simd;
use rowscan_protocol::rig::Axes;

use super::shapes::{Leaves, Vertex};
use super::sight::Points;
use crate::lanes::{Lanes, Mask};

/// A register of scene axes as vectors.
#[derive(Clone, Copy)]
pub(super) struct Frame<S: Simd>([Vertex<S>; 3]);

impl<S: Simd> Frame<S> {
    #[inline(always)]
    pub(super) fn of(simd: S, axes: &Axes) -> Self {
        Self([axes.to_row, axes.ahead, axes.up].map(|axis| Vertex::splat(simd, axis)))
    }

    /// A vector as the plane sees it.
    #[inline(always)]
    pub(super) fn seen(self, v: Vertex<S>) -> Vertex<S> {
        let [x, y, z] = self.0;
        Vertex { x: v.dot(x), y: v.dot(y), z: v.dot(z) }
    }
}

/// Leaves in the axes of a plane.
#[derive(Clone, Copy)]
pub(super) struct Turned<S: Simd, L: Leaves<S>> {
    frame: Frame<S>,
    leaves: L,
}

impl<S: Simd, L: Leaves<S>> Turned<S, L> {
    #[inline(always)]
    pub(super) fn new(frame: Frame<S>, leaves: L) -> Self {
        Self { frame, leaves }
    }
}

impl<S: Simd, L: Leaves<S>> Leaves<S> for Turned<S, L> {
    type At = L::At;

    #[inline(always)]
    fn vertices(self) -> usize {
        self.leaves.vertices()
    }

    #[inline(always)]
    fn at(self, vertex: usize) -> L::At {
        self.leaves.at(vertex)
    }

    #[inline(always)]
    fn y(self, at: L::At) -> Lanes<S> {
        let [_, ahead, _] = self.frame.0;
        self.leaves.placed(at).dot(ahead)
    }

    #[inline(always)]
    fn placed(self, at: L::At) -> Vertex<S> {
        self.frame.seen(self.leaves.placed(at))
    }

    #[inline(always)]
    fn select(mask: Mask<S>, yes: L::At, no: L::At) -> L::At {
        L::select(mask, yes, no)
    }

    #[inline(always)]
    fn between(low: L::At, high: L::At, share: Lanes<S>) -> L::At {
        L::between(low, high, share)
    }

    #[inline(always)]
    fn planes(self) -> (Vertex<S>, Vertex<S>) {
        let (normal, on) = self.leaves.planes();
        (self.frame.seen(normal), self.frame.seen(on))
    }

    /// About the mean of the vertices: the circles that are kept are those seen along Y.
    #[inline(always)]
    fn circles(self) -> (Points<S>, Lanes<S>) {
        let first = self.placed(self.at(0));
        let (zero, mut sum) = (first.x.of(0.0), Points(first.x, first.z));
        for vertex in 1..self.vertices() {
            let at = self.placed(self.at(vertex));
            sum = Points(sum.0 + at.x, sum.1 + at.z);
        }
        let share = zero.of(1.0 / self.vertices() as f64);
        let middle = Points(sum.0 * share, sum.1 * share);
        let mut square = zero;
        for vertex in 0..self.vertices() {
            let at = self.placed(self.at(vertex));
            let off = Points(at.x - middle.0, at.z - middle.1);
            square = square.max(off.dot(off));
        }
        (middle, square.sqrt() * zero.of(1.0 + 1e-8) + zero.of(1e-12))
    }
}
