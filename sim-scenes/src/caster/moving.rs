//! The leaf kernel of a scanner that moves while its mirror turns: every beam starts from its own place along Y.
//!
//! A beam meets a convex leaf if it passes all its edges on the same side. The side is the sign of a volume, (a - o) × (b - o) · d for
//! the edge from a to b, linear in the place along Y of the start o. While the leaf is passed the scanner hardly moves: unless a
//! vertex is passed too, the two edges that the plane crosses decide, and no others.

use pulp::Simd;

use super::leaf_field::Eight;
use super::leaves::{Edges, Form, LeafPass, Vertex, edges};
use super::nearest::marked;
use super::sight::{Part, Points, Sight};
use super::spans::{Spans, for_beams};
use crate::lanes::{Lanes, Mask, Row, WIDTH};

/// How far along Y the beams that may meet a leaf are thought to start beside where they do, metres: far above rounding.
const SPARE_M: f64 = 1e-9;

/// Eight leaves as seen from a moving scanner.
struct Passed {
    /// The edges that the plane crosses: volumes with beams from the line's origin, and what they gain a metre along Y.
    still: [[Row; 2]; 2],
    gain: [[Row; 2]; 2],
    /// Distances of the leaves' planes from the origin.
    distance: Row,
    /// Where the two edges do not decide: a vertex is passed with the leaf, or the leaf is passed again.
    by_all: Row,
    spans: Spans,
}

/// Enters all leaves.
#[inline(always)]
pub(super) fn pass<S: Simd, T: Sight>(pass: LeafPass<'_, T>, simd: S, depth: usize) {
    let LeafPass { field, sight, part, copy, nearest } = pass;
    let (p, q) = sight.parameters();
    let (mut slots, owners) = nearest.slots();
    let rows = [[Row::splat(0.0); 2]; 2];
    let mut passed = Passed {
        still: rows,
        gain: rows,
        distance: Row::splat(0.0),
        by_all: Row::splat(0.0),
        spans: Spans::of(sight),
    };
    let advance = Lanes::splat(simd, sight.advance_m());
    let (first, end) = part.beams;
    let zero = Lanes::splat(simd, 0.0);
    for eights in field.index.eights(part.y_m) {
        for eight in eights {
            let eight = *eight as usize;
            let Some(leaves) = field.eight(eight) else { continue };
            if !meetings(simd, leaves, sight, part, &mut passed) {
                continue;
            }
            let first_owner = owners.list(field.tags(eight), copy);
            for lane in 0..WIDTH {
                let owner = marked(first_owner + lane);
                let Passed { still, gain, .. } = &passed;
                let one = (Form::of(simd, &still[0], lane), Form::of(simd, &gain[0], lane));
                let other = (Form::of(simd, &still[1], lane), Form::of(simd, &gain[1], lane));
                let [normal_x, normal_y, normal_z] = leaves.normal;
                let normal = Points(normal_x.everywhere(simd, lane), normal_z.everywhere(simd, lane));
                let (distance, normal_y) =
                    (passed.distance.everywhere(simd, lane), normal_y.everywhere(simd, lane));
                for_beams!(S, passed.spans, lane, |beam, last| {
                    let (Some(p), Some(q)) = (Lanes::read(simd, p, beam), Lanes::read(simd, q, beam)) else {
                        break;
                    };
                    let number = Lanes::count_from(simd, beam);
                    let own =
                        zero.of(first as f64).le(number).and(number.lt(zero.of(end.min(last + 1) as f64)));
                    let moved = number * advance;
                    let inside = if passed.by_all.0[lane] == 0.0 {
                        let one = one.0.at(p, q) + moved * one.1.at(p, q);
                        let other = other.0.at(p, q) + moved * other.1.at(p, q);
                        zero.le(one.min(other)).or(one.max(other).le(zero))
                    } else {
                        within_all(simd, leaves.vertices, lane, part.origin, Points(p, q), moved)
                    };
                    let key = normal.dot(Points(p, q)) / (distance - normal_y * moved);
                    let ahead = zero.lt(key).and(key.lt(zero.of(f64::INFINITY)));
                    slots.insert(simd, beam, depth, inside.and(own).and(ahead), key, owner);
                });
            }
        }
    }
}

/// The beams that may meet each of eight leaves, and how they do. False if none meets any.
#[inline(always)]
fn meetings<S: Simd, T: Sight>(simd: S, leaves: Eight<'_>, sight: &T, of: Part, out: &mut Passed) -> bool {
    let Eight { normal, circle: [x, z, radius], vertices } = leaves;
    let Some(on) = vertices.first() else { return false };
    let [x_m, y_m, z_m] = of.origin;
    let zero = Lanes::splat(simd, 0.0);
    let (x_m, y_m, z_m) = (zero.of(x_m), zero.of(y_m), zero.of(z_m));
    let (step, turn) = (zero.of(sight.advance_m()), zero.of(sight.turn()));
    let mut any = false;
    for part in 0..Row::parts::<S>() {
        let middle = Points(x.load(simd, part) - x_m, z.load(simd, part) - z_m);
        let (from, to) = sight.meeting(middle, radius.load(simd, part));
        // Where along Y these beams start. Intervals may lie a turn below beam 0.
        let half_m = ((to - from) * step).abs() * zero.of(0.5) + zero.of(SPARE_M);
        let at_m = y_m + (from + to) * step * zero.of(0.5);
        let Edges { rise, fall, cut } = edges(simd, part, vertices, at_m);
        let turned = vertex_within(simd, part, vertices, at_m, half_m);
        // What comes round again, or might, is left to all edges.
        let again = (from + turn).lt(zero.of(sight.count() as f64)).or(turn.lt(to - from + zero.of(2.0)));
        let by_all = turned.or(again);
        let met = cut.or(by_all);
        any |= !met.is_empty();
        for (edge, [low, high]) in [(0, rise), (1, [fall[1], fall[0]])] {
            let (low, high) = (low.from(x_m, y_m, z_m), high.from(x_m, y_m, z_m));
            let (still, gain) = volume(low, high);
            out.still[edge][0].store(part, still.0);
            out.still[edge][1].store(part, still.1);
            out.gain[edge][0].store(part, gain.0);
            out.gain[edge][1].store(part, gain.1);
        }
        let (normal, on) =
            (Vertex::load(simd, part, normal), Vertex::load(simd, part, on).from(x_m, y_m, z_m));
        out.distance.store(part, normal.x * on.x + normal.y * on.y + normal.z * on.z);
        out.by_all.store(part, by_all.select(zero.of(1.0), zero));
        out.spans.set(part, met.select(from, zero.of(f64::INFINITY)), to);
    }
    any
}

/// Which leaves have a vertex within `half_m` of `at_m` along Y.
#[inline(always)]
fn vertex_within<S: Simd>(
    simd: S,
    part: usize,
    vertices: &[[Row; 3]],
    at_m: Lanes<S>,
    half_m: Lanes<S>,
) -> Mask<S> {
    let (low, high) = (at_m - half_m, at_m + half_m);
    let mut within = low.lt(low);
    for [_, y, _] in vertices {
        let y = y.load(simd, part);
        within = within.or(low.le(y).and(y.le(high)));
    }
    within
}

impl<S: Simd> Vertex<S> {
    #[inline(always)]
    fn from(self, x: Lanes<S>, y: Lanes<S>, z: Lanes<S>) -> Self {
        Self { x: self.x - x, y: self.y - y, z: self.z - z }
    }
}

/// (a - m e_y) × (b - m e_y), its X and Z: for m = 0, and what each metre m adds.
#[inline(always)]
fn volume<S: Simd>(a: Vertex<S>, b: Vertex<S>) -> (Points<S>, Points<S>) {
    (Points(a.y * b.z - a.z * b.y, a.x * b.y - a.y * b.x), Points(a.z - b.z, b.x - a.x))
}

/// Which of a register of beams pass all edges of leaf `lane` on the same side.
#[inline(always)]
fn within_all<S: Simd>(
    simd: S,
    vertices: &[[Row; 3]],
    lane: usize,
    [x_m, y_m, z_m]: [f64; 3],
    beam: Points<S>,
    moved: Lanes<S>,
) -> Mask<S> {
    let (x_m, y_m, z_m) = (Lanes::splat(simd, x_m), Lanes::splat(simd, y_m), Lanes::splat(simd, z_m));
    let zero = Lanes::splat(simd, 0.0);
    let (mut least, mut most) = (zero, zero);
    let mut from: Option<Vertex<S>> = None;
    for [x, y, z] in vertices.last().into_iter().chain(vertices) {
        let to = Vertex { x: zero.of(x.0[lane]), y: zero.of(y.0[lane]), z: zero.of(z.0[lane]) };
        let to = to.from(x_m, y_m, z_m);
        if let Some(from) = from {
            let (still, gain) = volume(from, to);
            let side = still.dot(beam) + moved * gain.dot(beam);
            (least, most) = (least.min(side), most.max(side));
        }
        from = Some(to);
    }
    zero.le(least).or(most.le(zero))
}
