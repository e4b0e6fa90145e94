//! The leaf kernel of a scanner that moves while its mirror turns: every beam starts from its own place along Y.
//!
//! A beam meets a convex leaf if it passes all its edges on the same side. The side is the sign of a volume, (a - o) × (b - o) · d for
//! the edge from a to b, linear in the place along Y of the start o. While the leaf is passed the scanner hardly moves: unless a
//! vertex is passed too, the two edges that the plane crosses decide, and no others.

use pulp::Simd;

use super::leaf_pass::{BATCH, Edges, Form, LeafPass, edges, fetch};
use super::nearest::marked;
use super::shapes::{Leaves, Shapes, Vertex};
use super::sight::{Part, Points, Sight};
use super::spans::{Spans, for_beams};
use super::turned::{Frame, Turned};
use crate::lanes::{Lanes, Mask, Row, WIDTH};

/// How far along Y the beams that may meet a leaf are thought to start beside where they do, metres: far above rounding.
const SPARE_M: f64 = 1e-9;

/// Eight leaves as seen from a moving scanner.
struct Passed {
    /// The edges that the plane crosses: volumes with beams from the line's origin, and what they gain a metre along Y.
    still: [[Row; 2]; 2],
    gain: [[Row; 2]; 2],
    /// The leaves' planes: X and Z of normals, what they gain a metre along the way, and distances from the origin.
    normal: [Row; 2],
    gained: Row,
    distance: Row,
    /// Where the two edges do not decide: a vertex is passed with the leaf, or the leaf is passed again.
    by_all: Row,
    spans: Spans,
}

/// Enters all leaves.
#[inline(always)]
pub(super) fn pass<S: Simd, T: Sight>(pass: LeafPass<'_, T>, simd: S, shapes: &impl Shapes, depth: usize) {
    let LeafPass { field, sight, part, copy, nearest } = pass;
    let (p, q) = sight.parameters();
    let (Some(q), Some((mut slots, owners))) = (q.get(..p.len()), nearest.slots(p.len(), depth)) else {
        return;
    };
    let rows = [[Row::splat(0.0); 2]; 2];
    let mut passed = Passed {
        still: rows,
        gain: rows,
        normal: [Row::splat(0.0); 2],
        gained: Row::splat(0.0),
        distance: Row::splat(0.0),
        by_all: Row::splat(0.0),
        spans: Spans::of(sight.turn(), sight.count()),
    };
    let advance = Lanes::splat(simd, sight.advance_m());
    let (first, end) = part.beams;
    let zero = Lanes::splat(simd, 0.0);
    for eights in field.index.eights(part.y_m) {
        for batch in eights.chunks(BATCH) {
            let first_owner = fetch(field, shapes, batch, copy, owners);
            for (eight, first_owner) in batch.iter().zip((first_owner..).step_by(WIDTH)) {
                let eight = *eight as usize;
                if !meetings(simd, shapes, eight, sight, part, &mut passed) {
                    continue;
                }
                for lane in 0..WIDTH {
                    let owner = marked(first_owner + lane);
                    let Passed { still, gain, normal: [normal_x, normal_z], gained, .. } = &passed;
                    let one = (Form::of(simd, &still[0], lane), Form::of(simd, &gain[0], lane));
                    let other = (Form::of(simd, &still[1], lane), Form::of(simd, &gain[1], lane));
                    let normal = Points(normal_x.everywhere(simd, lane), normal_z.everywhere(simd, lane));
                    let (distance, gained) =
                        (passed.distance.everywhere(simd, lane), gained.everywhere(simd, lane));
                    for_beams!(S, passed.spans, lane, |beam, last| {
                        let (Some(p), Some(q)) = (Lanes::read(simd, p, beam), Lanes::read(simd, q, beam))
                        else {
                            break;
                        };
                        let number = Lanes::count_from(simd, beam);
                        let own = zero
                            .of(first as f64)
                            .le(number)
                            .and(number.lt(zero.of(end.min(last + 1) as f64)));
                        let moved = number * advance;
                        let inside = if passed.by_all.0[lane] == 0.0 {
                            let one = one.0.at(p, q) + moved * one.1.at(p, q);
                            let other = other.0.at(p, q) + moved * other.1.at(p, q);
                            zero.le(one.min(other)).or(one.max(other).le(zero))
                        } else {
                            within_all::<_, T>(
                                simd,
                                shapes.outline(eight, lane),
                                part.origin,
                                sight,
                                Points(p, q),
                                moved,
                            )
                        };
                        let key = normal.dot(Points(p, q)) / (distance - gained * moved);
                        let ahead = zero.lt(key).and(key.lt(zero.of(f64::INFINITY)));
                        slots.insert(simd, beam, depth, inside.and(own).and(ahead), key, owner);
                    });
                }
            }
        }
    }
}

/// The beams that may meet each of eight leaves, and how they do. False if none meets any.
#[inline(always)]
fn meetings<S: Simd, T: Sight>(
    simd: S,
    shapes: &impl Shapes,
    eight: usize,
    sight: &T,
    of: Part,
    out: &mut Passed,
) -> bool {
    let mut any = false;
    for part in 0..Row::parts::<S>() {
        let Some(leaves) = shapes.leaves(simd, eight, part, of.origin) else { break };
        any |= if T::LEANS {
            register(simd, Turned::new(Frame::of(simd, sight.axes()), leaves), part, sight, out)
        } else {
            register(simd, leaves, part, sight, out)
        };
    }
    any
}

/// The same for one register of them.
#[inline(always)]
fn register<S: Simd, T: Sight>(
    simd: S,
    leaves: impl Leaves<S>,
    part: usize,
    sight: &T,
    out: &mut Passed,
) -> bool {
    let zero = Lanes::splat(simd, 0.0);
    // From beam to beam along the plane's own Y.
    let step_m = if T::LEANS { sight.way()[1] } else { sight.advance_m() };
    let (step, turn) = (zero.of(step_m), zero.of(sight.turn()));
    let (middle, radius) = leaves.circles();
    let (from, to) = sight.meeting(middle, radius);
    // Where along Y these beams start. Intervals may lie a turn below beam 0.
    let half_m = ((to - from) * step).abs() * zero.of(0.5) + zero.of(SPARE_M);
    let at_m = (from + to) * step * zero.of(0.5);
    let Edges { rise, fall, cut } = edges(leaves, at_m);
    let turned = vertex_within(leaves, at_m, half_m);
    // What comes round again, or might, is left to all edges.
    let again = (from + turn).lt(zero.of(sight.count() as f64)).or(turn.lt(to - from + zero.of(2.0)));
    let by_all = turned.or(again);
    let met = cut.or(by_all);
    for (edge, [low, high]) in [(0, rise), (1, [fall[1], fall[0]])] {
        let (still, gain) = volume::<_, T>(simd, sight, leaves.placed(low.at), leaves.placed(high.at));
        out.still[edge][0].store(part, still.0);
        out.still[edge][1].store(part, still.1);
        out.gain[edge][0].store(part, gain.0);
        out.gain[edge][1].store(part, gain.1);
    }
    let (normal, on) = leaves.planes();
    out.normal[0].store(part, normal.x);
    out.normal[1].store(part, normal.z);
    out.gained.store(part, if T::LEANS { normal.dot(along(simd, sight)) } else { normal.y });
    out.distance.store(part, normal.dot(on));
    out.by_all.store(part, by_all.select(zero.of(1.0), zero));
    out.spans.set(part, met.select(from, zero.of(f64::INFINITY)), to);
    !met.is_empty()
}

/// A metre of the scanner's way, by the plane's axes.
#[inline(always)]
fn along<S: Simd>(simd: S, sight: &impl Sight) -> Vertex<S> {
    Vertex::splat(simd, sight.axes().seen([0.0, 1.0, 0.0]))
}

/// Which leaves have a vertex within `half_m` of `at_m` along Y.
#[inline(always)]
fn vertex_within<S: Simd>(leaves: impl Leaves<S>, at_m: Lanes<S>, half_m: Lanes<S>) -> Mask<S> {
    let (low, high) = (at_m - half_m, at_m + half_m);
    let mut within = low.lt(low);
    for vertex in 0..leaves.vertices() {
        let y = leaves.y(leaves.at(vertex));
        within = within.or(low.le(y).and(y.le(high)));
    }
    within
}

/// (a - m v) × (b - m v), its X and Z, v a metre of the way: for m = 0, and what each metre m adds, v × (a - b).
#[inline(always)]
fn volume<S: Simd, T: Sight>(simd: S, sight: &T, a: Vertex<S>, b: Vertex<S>) -> (Points<S>, Points<S>) {
    let still = Points(a.y * b.z - a.z * b.y, a.x * b.y - a.y * b.x);
    if !T::LEANS {
        return (still, Points(a.z - b.z, b.x - a.x));
    }
    let gain = along(simd, sight).cross(a.from(b));
    (still, Points(gain.x, gain.z))
}

/// Which of a register of beams pass all edges of a leaf on the same side.
#[inline(always)]
fn within_all<S: Simd, T: Sight>(
    simd: S,
    outline: impl Iterator<Item = [f64; 3]> + Clone,
    origin: [f64; 3],
    sight: &T,
    beam: Points<S>,
    moved: Lanes<S>,
) -> Mask<S> {
    let zero = moved.of(0.0);
    let (mut least, mut most) = (zero, zero);
    let mut from: Option<Vertex<S>> = None;
    for vertex in outline.clone().last().into_iter().chain(outline) {
        let mut to = Vertex::splat(simd, vertex).from(Vertex::splat(simd, origin));
        if T::LEANS {
            to = Frame::of(simd, sight.axes()).seen(to);
        }
        if let Some(from) = from {
            let (still, gain) = volume(simd, sight, from, to);
            let side = still.dot(beam) + moved * gain.dot(beam);
            (least, most) = (least.min(side), most.max(side));
        }
        from = Some(to);
    }
    zero.le(least).or(most.le(zero))
}
