//! Where the vertices of eight leaves come from: a template that all of them share, or each leaf's own list.

use pulp::Simd;

use super::sight::Points;
use crate::lanes::{Lanes, Mask, Row};

/// Leaves whose vertices come from one kind of source, eight by eight.
pub(super) trait Shapes: Sync {
    /// A register of them.
    type Leaves<'a, S: Simd>: Leaves<S>
    where
        Self: 'a;

    /// Register `part` of eight leaves, as seen from `origin`; None if there are no such eight.
    fn leaves<S: Simd>(
        &self,
        simd: S,
        eight: usize,
        part: usize,
        origin: [f64; 3],
    ) -> Option<Self::Leaves<'_, S>>;

    /// What registers of eight leaves are read from.
    fn rows(&self, eight: usize) -> &[Row];

    /// The vertices of one leaf, in order.
    fn outline(&self, eight: usize, lane: usize) -> impl Iterator<Item = [f64; 3]> + Clone;
}

/// A register of leaves as seen from a line's origin. Vertices are cut where they come from; only those picked are placed in the scene.
pub(super) trait Leaves<S: Simd>: Copy {
    /// A register of vertices where they come from.
    type At: Copy;

    fn vertices(self) -> usize;
    fn at(self, vertex: usize) -> Self::At;
    fn y(self, at: Self::At) -> Lanes<S>;
    fn placed(self, at: Self::At) -> Vertex<S>;
    fn select(mask: Mask<S>, yes: Self::At, no: Self::At) -> Self::At;
    /// The point that lies `share` of the way from one vertex to another.
    fn between(low: Self::At, high: Self::At, share: Lanes<S>) -> Self::At;
    /// Normals, of any length, and points of their planes.
    fn planes(self) -> (Vertex<S>, Vertex<S>);
    /// Circles about all vertices as seen along Y: middles and radii.
    fn circles(self) -> (Points<S>, Lanes<S>);
}

/// A leaf as it is kept.
#[derive(Clone, Copy)]
pub(super) struct Entry<'a> {
    pub(super) outline: &'a [[f64; 3]],
    pub(super) normal: [f64; 3],
    /// How far it is shifted along Y.
    pub(super) shift_m: f64,
}

/// A register of vertices or vectors.
#[derive(Clone, Copy)]
pub(super) struct Vertex<S: Simd> {
    pub(super) x: Lanes<S>,
    pub(super) y: Lanes<S>,
    pub(super) z: Lanes<S>,
}

impl<S: Simd> Vertex<S> {
    #[inline(always)]
    pub(super) fn load(simd: S, part: usize, [x, y, z]: &[Row; 3]) -> Self {
        Self { x: x.load(simd, part), y: y.load(simd, part), z: z.load(simd, part) }
    }

    #[inline(always)]
    pub(super) fn splat(simd: S, [x, y, z]: [f64; 3]) -> Self {
        Self { x: Lanes::splat(simd, x), y: Lanes::splat(simd, y), z: Lanes::splat(simd, z) }
    }

    #[inline(always)]
    pub(super) fn select(mask: Mask<S>, yes: Self, no: Self) -> Self {
        Self { x: mask.select(yes.x, no.x), y: mask.select(yes.y, no.y), z: mask.select(yes.z, no.z) }
    }

    #[inline(always)]
    pub(super) fn from(self, origin: Self) -> Self {
        Self { x: self.x - origin.x, y: self.y - origin.y, z: self.z - origin.z }
    }

    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> Lanes<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }
}

/// Radius of a circle about (x, z) that holds an outline as seen along Y.
pub(super) fn radius(outline: &[[f64; 3]], x: f64, z: f64) -> f64 {
    let radius = outline.iter().map(|v| (v[0] - x).hypot(v[2] - z)).fold(0.0, f64::max);
    // A leaf of a template may lie off by what its template allows.
    radius * (1.0 + 1e-8) + 1e-12
}
