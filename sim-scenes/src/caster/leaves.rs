//! The leaf kernel: polygon ∩ scan plane = a segment; a segment covers a run of beams. Eight leaves at a time are cut, eight beams at a
//! time are covered.

use pulp::{Simd, WithSimd};

use super::leaf_field::{Eight, LeafField};
use super::moving;
use super::nearest::{Nearest, marked};
use super::sight::{Cut, Part, Points, Segments, Sight};
use super::spans::for_beams;
use crate::lanes::{Lanes, Mask, Row, WIDTH};

/// Leaves whose plane is nearer than this to the scan plane (sine of the angle) are edge-on and return nothing.
const PARALLEL: f64 = 1e-12;

/// Enters every leaf that the plane of a line cuts, or that a moving scanner's beams meet.
pub(super) struct LeafPass<'a, T> {
    pub(super) field: &'a LeafField,
    pub(super) sight: &'a T,
    pub(super) part: Part,
    /// Whose the organs are, if a copy's.
    pub(super) copy: Option<u32>,
    pub(super) nearest: &'a mut Nearest,
}

impl<T: Sight> WithSimd for LeafPass<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        // The usual depths get loops of a known length.
        match (self.nearest.depth(), self.sight.advance_m() != 0.0) {
            (1, false) => self.pass(simd, 1),
            (3, false) => self.pass(simd, 3),
            (depth, false) => self.pass(simd, depth),
            (1, true) => moving::pass(self, simd, 1),
            (depth, true) => moving::pass(self, simd, depth),
        }
    }
}

impl<T: Sight> LeafPass<'_, T> {
    #[inline(always)]
    fn pass<S: Simd>(self, simd: S, depth: usize) {
        let Self { field, sight, part, copy, nearest } = self;
        let (p, q) = sight.parameters();
        let (mut slots, owners) = nearest.slots();
        let mut segments = Segments::of(sight);
        let zero = Lanes::splat(simd, 0.0);
        for eights in field.index.eights(part.y_m) {
            for eight in eights {
                let eight = *eight as usize;
                let Some(leaves) = field.eight(eight) else { continue };
                cut(simd, leaves, part.origin, sight, &mut segments);
                let first_owner = owners.list(field.tags(eight), copy);
                for lane in 0..WIDTH {
                    let owner = marked(first_owner + lane);
                    let key = Form::of(simd, &segments.key, lane);
                    let (after, before) =
                        (Form::of(simd, &segments.from, lane), Form::of(simd, &segments.to, lane));
                    // Two signs a beam, the first end included, the second not, so that of two segments that share an
                    // end exactly one is met.
                    for_beams!(S, segments.spans, lane, |beam, last| {
                        let (Some(p), Some(q)) = (Lanes::read(simd, p, beam), Lanes::read(simd, q, beam))
                        else {
                            break;
                        };
                        let met = zero.le(after.at(p, q)).and(zero.lt(before.at(p, q)));
                        slots.insert(simd, beam, depth, met, key.at(p, q), owner);
                    });
                }
            }
        }
    }
}

/// Eight leaves cut by the plane y = `origin[1]`.
#[inline(always)]
fn cut<S: Simd, T: Sight>(
    simd: S,
    leaves: Eight<'_>,
    [x_m, y_m, z_m]: [f64; 3],
    sight: &T,
    out: &mut Segments,
) {
    let Some(first) = leaves.vertices.first() else { return };
    let (x_m, y_m, z_m) = (Lanes::splat(simd, x_m), Lanes::splat(simd, y_m), Lanes::splat(simd, z_m));
    for part in 0..Row::parts::<S>() {
        let Edges { rise, fall, cut } = edges(simd, part, leaves.vertices, y_m);
        let normal = Vertex::load(simd, part, leaves.normal);
        let on = Vertex::load(simd, part, first);
        let distance = normal.x * (on.x - x_m) + normal.y * (on.y - y_m) + normal.z * (on.z - z_m);
        let facing = Lanes::splat(simd, PARALLEL).le(normal.x.abs().max(normal.z.abs()));
        let [a, b] = [crossing(rise, y_m), crossing(fall, y_m)];
        let leaves = Cut {
            a: Points(a.0 - x_m, a.1 - z_m),
            b: Points(b.0 - x_m, b.1 - z_m),
            normal: Points(normal.x, normal.z),
            distance,
            cut: cut.and(facing),
        };
        sight.segments(simd, part, leaves, out);
    }
}

/// The edges of a register of leaves that cross planes of one Y each.
pub(super) struct Edges<S: Simd> {
    /// Lower and upper end of the edge that rises through the plane.
    pub(super) rise: [Vertex<S>; 2],
    /// And of the one that falls.
    pub(super) fall: [Vertex<S>; 2],
    /// Which leaves are cut at all.
    pub(super) cut: Mask<S>,
}

/// Convex, so the outline rises through the plane once and falls through it once. A vertex on the plane counts as below it.
#[inline(always)]
pub(super) fn edges<S: Simd>(simd: S, part: usize, vertices: &[[Row; 3]], y_m: Lanes<S>) -> Edges<S> {
    let mut from = Vertex::load(simd, part, vertices.last().unwrap_or(&[Row::splat(0.0); 3]));
    let mut from_above = y_m.lt(from.y);
    let mut from_below = from.y.le(y_m);
    let (mut rise, mut fall) = ([from, from], [from, from]);
    let mut cut = y_m.lt(y_m);
    for to in vertices {
        let to = Vertex::load(simd, part, to);
        let (to_above, to_below) = (y_m.lt(to.y), to.y.le(y_m));
        let (rises, falls) = (to_above.and(from_below), from_above.and(to_below));
        rise = [Vertex::select(rises, from, rise[0]), Vertex::select(rises, to, rise[1])];
        fall = [Vertex::select(falls, to, fall[0]), Vertex::select(falls, from, fall[1])];
        cut = cut.or(rises);
        (from, from_above, from_below) = (to, to_above, to_below);
    }
    Edges { rise, fall, cut }
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
    fn select(mask: Mask<S>, yes: Self, no: Self) -> Self {
        Self { x: mask.select(yes.x, no.x), y: mask.select(yes.y, no.y), z: mask.select(yes.z, no.z) }
    }
}

/// Where edges cross the plane. Always from the lower end, so that two pieces that share an edge share the crossing to the last bit.
#[inline(always)]
fn crossing<S: Simd>([low, high]: [Vertex<S>; 2], y_m: Lanes<S>) -> Points<S> {
    let share = (y_m - low.y) / (high.y - low.y);
    Points(low.x + share * (high.x - low.x), low.z + share * (high.z - low.z))
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
