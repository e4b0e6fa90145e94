//! What the two leaf kernels, at rest and moving, have in common: the line they serve, memory in batches, the edges that a plane crosses.

use std::hint::black_box;

use pulp::Simd;

use super::leaf_field::LeafField;
use super::nearest::{Nearest, Owners};
use super::shapes::{Leaves, Shapes};
use super::sight::Part;
use crate::lanes::{Lanes, Mask, Row};

/// Enters every leaf that the plane of a line cuts, or that a moving scanner's beams meet.
pub(super) struct LeafPass<'a, T> {
    pub(super) field: &'a LeafField,
    pub(super) sight: &'a T,
    pub(super) part: Part,
    /// Whose the organs are, if a copy's.
    pub(super) copy: Option<u32>,
    pub(super) nearest: &'a mut Nearest,
}

/// Eights that are read from memory at once.
pub(super) const BATCH: usize = 16;

/// Reads a batch of eights from memory before the first of it is looked at, and lists whose they are. Gives the first one's number.
/// Eights lie scattered: one by one, each would be waited for.
#[inline(always)]
pub(super) fn fetch(
    field: &LeafField,
    shapes: &impl Shapes,
    batch: &[u32],
    copy: Option<u32>,
    owners: &mut Owners,
) -> usize {
    let rows = batch.iter().flat_map(|eight| shapes.rows(*eight as usize));
    black_box(rows.fold(0, |all, row| all | row.0[0].to_bits()));
    let first = owners.next();
    for eight in batch {
        owners.list(field.tags(*eight as usize), copy);
    }
    first
}

/// A register of vertices: where they come from, and how far beyond a plane along Y.
#[derive(Clone, Copy)]
pub(super) struct End<S: Simd, A> {
    pub(super) at: A,
    pub(super) above: Lanes<S>,
}

impl<S: Simd, A: Copy> End<S, A> {
    #[inline(always)]
    fn of<L: Leaves<S, At = A>>(leaves: L, vertex: usize, y_m: Lanes<S>) -> Self {
        let at = leaves.at(vertex);
        Self { at, above: leaves.y(at) - y_m }
    }

    #[inline(always)]
    fn select<L: Leaves<S, At = A>>(_: L, mask: Mask<S>, yes: Self, no: Self) -> Self {
        Self { at: L::select(mask, yes.at, no.at), above: mask.select(yes.above, no.above) }
    }
}

/// The edges of a register of leaves that cross planes of one Y each.
pub(super) struct Edges<S: Simd, A> {
    /// Lower and upper end of the edge that rises through the plane.
    pub(super) rise: [End<S, A>; 2],
    /// And of the one that falls.
    pub(super) fall: [End<S, A>; 2],
    /// Which leaves are cut at all.
    pub(super) cut: Mask<S>,
}

/// Convex, so the outline rises through the plane once and falls through it once. A vertex on the plane counts as below it.
#[inline(always)]
pub(super) fn edges<S: Simd, L: Leaves<S>>(leaves: L, y_m: Lanes<S>) -> Edges<S, L::At> {
    let zero = y_m.of(0.0);
    let mut from = End::of(leaves, leaves.vertices() - 1, y_m);
    let mut from_above = zero.lt(from.above);
    let (mut rise, mut fall) = ([from, from], [from, from]);
    let mut cut = zero.lt(zero);
    for vertex in 0..leaves.vertices() {
        let to = End::of(leaves, vertex, y_m);
        let to_above = zero.lt(to.above);
        let crosses = from_above.xor(to_above);
        let (rises, falls) = (crosses.and(to_above), crosses.and(from_above));
        rise = [End::select(leaves, rises, from, rise[0]), End::select(leaves, rises, to, rise[1])];
        fall = [End::select(leaves, falls, to, fall[0]), End::select(leaves, falls, from, fall[1])];
        cut = cut.or(rises);
        (from, from_above) = (to, to_above);
    }
    Edges { rise, fall, cut }
}

/// A linear form in (p, q).
pub(super) struct Form<S: Simd>(Lanes<S>, Lanes<S>);

impl<S: Simd> Form<S> {
    #[inline(always)]
    pub(super) fn of(simd: S, [a, b]: &[Row; 2], lane: usize) -> Self {
        Self(a.everywhere(simd, lane), b.everywhere(simd, lane))
    }

    #[inline(always)]
    pub(super) fn at(&self, p: Lanes<S>, q: Lanes<S>) -> Lanes<S> {
        self.0 * p + self.1 * q
    }
}
