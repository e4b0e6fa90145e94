//! The leaf kernel of a scanner that moves while its mirror turns: every beam starts from its own place along Y.
//!
//! A beam meets a convex leaf if it passes all its edges on the same side. The side is the sign of a volume, (a - o) × (b - o) · d for
//! the edge from a to b, linear in the place along Y of the start o. So no plane is cut: the edges decide beam by beam, among the beams
//! that may see a circle about the leaf from within its extent along Y.

use pulp::Simd;

use super::lanes::{Lanes, Row, WIDTH};
use super::leaves::LeafPass;
use super::nearest::insert;
use super::sight::{Part, Points, Sight, Turning};

/// How far the extent along Y is widened, metres: far above rounding.
const SPARE_M: f64 = 1e-9;

/// Enters all leaves.
#[inline(always)]
pub(super) fn pass<S: Simd, T: Sight>(pass: LeafPass<'_, T>, simd: S) {
    let LeafPass { field, sight, part, first_owner, nearest } = pass;
    let (p, q) = sight.parameters();
    let depth = nearest.depth();
    let turning = Turning::of(sight);
    let (mut low, mut high) = (Row::splat(0.0), Row::splat(0.0));
    for eight in field.eights(part.y_m) {
        let Some((header, vertices)) = field.eight(eight).and_then(|values| values.split_first_chunk::<6>())
        else {
            continue;
        };
        let (vertices, _) = vertices.as_chunks::<3>();
        let [normal_x, normal_y, normal_z, circle @ ..] = header;
        intervals(simd, circle, vertices, sight, part, (&mut low, &mut high));
        for lane in 0..WIDTH {
            let mut runs = turning.runs::<WIDTH>(low.0[lane], high.0[lane]);
            while let Some(rows) = runs.next() {
                let (Some(p), Some(q)) = (p.get(rows.clone()), q.get(rows.clone())) else { continue };
                let normal = [normal_x.0[lane], normal_y.0[lane], normal_z.0[lane]];
                let owner = Lanes::splat(simd, (first_owner + eight * WIDTH + lane) as f64);
                let (keys, owners) = nearest.slots(rows.start, rows.end);
                let slots = keys.chunks_exact_mut(depth).zip(owners.chunks_exact_mut(depth));
                for (((row, p), q), (keys, owners)) in rows.zip(p).zip(q).zip(slots) {
                    for register in 0..Row::parts::<S>() {
                        let beam = Points(p.load(simd, register), q.load(simd, register));
                        let (moved, own) = part.beams_of(simd, sight.advance_m(), row, register);
                        let (key, inside) = meet(simd, vertices, lane, normal, part.origin, beam, moved);
                        insert(register, inside.and(own), key, owner, simd, keys, owners);
                    }
                }
            }
        }
    }
}

/// The beams that may meet each of eight leaves.
#[inline(always)]
fn intervals<S: Simd, T: Sight>(
    simd: S,
    [x, z, radius]: &[Row; 3],
    vertices: &[[Row; 3]],
    sight: &T,
    of: Part,
    (low, high): (&mut Row, &mut Row),
) {
    let [x_m, y_m, z_m] = of.origin;
    let zero = Lanes::splat(simd, 0.0);
    for part in 0..Row::parts::<S>() {
        let middle = Points(x.load(simd, part) - zero.of(x_m), z.load(simd, part) - zero.of(z_m));
        let (from, to) = sight.swept(simd, middle, middle, radius.load(simd, part));
        let (mut least, mut most) = (zero.of(f64::INFINITY), zero.of(f64::NEG_INFINITY));
        for [_, y, _] in vertices {
            let y = y.load(simd, part);
            (least, most) = (least.min(y), most.max(y));
        }
        // Where the part of the line in which they may be met passes the leaf. Intervals may lie a turn below beam 0.
        let (step, turn) = (zero.of(sight.advance_m()), zero.of(sight.turn()));
        let (at_from, at_to) = (zero.of(y_m) + from * step, zero.of(y_m) + to * step);
        let spare = zero.of(SPARE_M);
        let passes = (at_from.min(at_to) - spare).le(most).and(least.le(at_from.max(at_to) + spare));
        // What comes round again, or might, is left to the edges.
        let again = (from + turn).lt(zero.of(sight.count() as f64)).or(turn.lt(to - from + zero.of(2.0)));
        let whole = least.le(zero.of(of.y_m.1)).and(zero.of(of.y_m.0).le(most));
        low.store(part, passes.or(again).and(whole).select(from, zero.of(f64::INFINITY)));
        high.store(part, to);
    }
}

/// Key of one leaf's plane along a register of beams, and which of them meet the leaf.
#[inline(always)]
fn meet<S: Simd>(
    simd: S,
    vertices: &[[Row; 3]],
    lane: usize,
    [normal_x, normal_y, normal_z]: [f64; 3],
    [x_m, y_m, z_m]: [f64; 3],
    beam: Points<S>,
    moved: Lanes<S>,
) -> (Lanes<S>, super::lanes::Mask<S>) {
    let zero = Lanes::splat(simd, 0.0);
    let (mut least, mut most) = (zero, zero);
    let mut first = [0.0; 3];
    let mut from = [0.0; 3];
    for (number, [x, y, z]) in vertices.iter().chain(vertices.first()).enumerate() {
        let to = [x.0[lane] - x_m, y.0[lane] - y_m, z.0[lane] - z_m];
        if number == 0 {
            (first, from) = (to, to);
            continue;
        }
        // (a - m e_y) × (b - m e_y), its X and Z.
        let still = Points(
            Lanes::splat(simd, from[1] * to[2] - from[2] * to[1]),
            Lanes::splat(simd, from[0] * to[1] - from[1] * to[0]),
        );
        let rate = Points(Lanes::splat(simd, from[2] - to[2]), Lanes::splat(simd, to[0] - from[0]));
        let side = still.dot(beam) + moved * rate.dot(beam);
        (least, most) = (least.min(side), most.max(side));
        from = to;
    }
    let distance = normal_x * first[0] + normal_y * first[1] + normal_z * first[2];
    let facing = beam.onto((normal_x, normal_z));
    let key = facing / (zero.of(distance) - zero.of(normal_y) * moved);
    let one_side = zero.le(least).or(most.le(zero));
    (key, one_side.and(zero.lt(key)).and(key.lt(zero.of(f64::INFINITY))))
}
