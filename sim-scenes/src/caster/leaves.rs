//! The leaf kernel: polygon ∩ scan plane = a segment; a segment covers a run of beams. Eight leaves at a time are cut, eight beams at a
//! time are covered.

use std::hint::black_box;

use pulp::{Simd, WithSimd};

use super::leaf_field::{Kind, LeafField};
use super::moving;
use super::nearest::{Nearest, Owners, marked};
use super::shapes::{Leaves, Shapes};
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
        match &self.field.kind {
            Kind::Alike(leaves) => self.of(simd, leaves),
            Kind::Outlined(leaves) => self.of(simd, leaves),
        }
    }
}

impl<T: Sight> LeafPass<'_, T> {
    #[inline(always)]
    fn of<S: Simd>(self, simd: S, shapes: &impl Shapes) {
        // The usual depths get loops of a known length.
        match (self.nearest.depth(), self.sight.advance_m() != 0.0) {
            (1, false) => self.pass(simd, shapes, 1),
            (3, false) => self.pass(simd, shapes, 3),
            (depth, false) => self.pass(simd, shapes, depth),
            (1, true) => moving::pass(self, simd, shapes, 1),
            (depth, true) => moving::pass(self, simd, shapes, depth),
        }
    }

    #[inline(always)]
    fn pass<S: Simd>(self, simd: S, shapes: &impl Shapes, depth: usize) {
        let Self { field, sight, part, copy, nearest } = self;
        let (p, q) = sight.parameters();
        let (Some(q), Some((mut slots, owners))) = (q.get(..p.len()), nearest.slots(p.len(), depth)) else {
            return;
        };
        let mut segments = Segments::of(sight);
        let zero = Lanes::splat(simd, 0.0);
        for eights in field.index.eights(part.y_m) {
            for batch in eights.chunks(BATCH) {
                let first = fetch(field, shapes, batch, copy, owners);
                for (eight, first_owner) in batch.iter().zip((first..).step_by(WIDTH)) {
                    if !cut(simd, shapes, *eight as usize, part.origin, sight, &mut segments) {
                        continue;
                    }
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

/// Eight leaves cut by the plane y = `origin[1]`. False if it cuts none.
#[inline(always)]
fn cut<S: Simd, T: Sight>(
    simd: S,
    shapes: &impl Shapes,
    eight: usize,
    origin: [f64; 3],
    sight: &T,
    out: &mut Segments,
) -> bool {
    let mut any = false;
    for part in 0..Row::parts::<S>() {
        let Some(leaves) = shapes.leaves(simd, eight, part, origin) else { break };
        let Edges { rise, fall, cut } = edges(leaves, Lanes::splat(simd, 0.0));
        let (normal, on) = leaves.planes();
        let facing = (normal.y.abs() * normal.y.of(PARALLEL)).le(normal.x.abs().max(normal.z.abs()));
        let cut = Cut {
            a: crossing(leaves, rise),
            b: crossing(leaves, fall),
            normal: Points(normal.x, normal.z),
            distance: normal.dot(on),
            cut: cut.and(facing),
        };
        any |= !cut.cut.is_empty();
        sight.segments(simd, part, cut, out);
    }
    any
}

/// A register of vertices: where they come from, and how far beyond a plane along Y.
#[derive(Clone, Copy)]
pub(super) struct End<S: Simd, A> {
    pub(super) at: A,
    above: Lanes<S>,
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

/// Where edges cross the plane. Always from the lower end, so that two pieces that share an edge share the crossing to the last bit.
#[inline(always)]
fn crossing<S: Simd, L: Leaves<S>>(leaves: L, [low, high]: [End<S, L::At>; 2]) -> Points<S> {
    let at = leaves.placed(L::between(low.at, high.at, low.above / (low.above - high.above)));
    Points(at.x, at.z)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::caster::alike::Alike;
    use crate::caster::outlined::Outlined;
    use crate::caster::shapes::Entry;
    use crate::caster::template::Template;
    use crate::lanes::WIDTH;
    use crate::seed::Purpose;

    /// A crossing of a leaf as a fan sees it from the origin: X and Z of both ends.
    fn crossings(shapes: &impl Shapes, eight: usize, y_m: f64) -> [[f64; 4]; WIDTH] {
        let simd = pulp::Scalar::new();
        std::array::from_fn(|lane| {
            let leaves = shapes.leaves(simd, eight, lane, [0.0, y_m, 0.0]).unwrap();
            let Edges { rise, fall, cut } = edges(leaves, Lanes::splat(simd, 0.0));
            let mut row = Row::splat(f64::NAN);
            for (part, at) in [crossing(leaves, rise), crossing(leaves, fall)].into_iter().enumerate() {
                row.store(2 * part, cut.select(at.0, at.0.of(f64::NAN)));
                row.store(2 * part + 1, cut.select(at.1, at.1.of(f64::NAN)));
            }
            std::array::from_fn(|place| row.0[place])
        })
    }

    #[test]
    fn leaves_of_a_template_are_cut_where_their_own_vertices_have_it() {
        let mut stream = Purpose::Growth.stream(3, 0, 0);
        let mut unit = || 2.0 * stream.unit() - 1.0;
        let blade: [[f64; 2]; 8] = [
            [0.0, 0.0],
            [0.12, 0.2],
            [0.4, 0.28],
            [0.75, 0.2],
            [1.0, 0.0],
            [0.7, -0.2],
            [0.4, -0.3],
            [0.1, -0.2],
        ];
        // Turned, stretched, skewed and mirrored.
        let outlines: Vec<Vec<[f64; 3]>> = (0..800)
            .map(|_| {
                let [c, u, v]: [[f64; 3]; 3] = [3.0, 0.06, 0.06].map(|size| [(); 3].map(|()| size * unit()));
                blade.map(|[a, b]| std::array::from_fn(|i| c[i] + a * u[i] + b * v[i])).to_vec()
            })
            .collect();
        let (templates, of) = Template::among(&outlines);
        assert!(templates.len() == 1 && of.iter().all(|of| *of == Some(0)));
        let (mut alike, mut outlined) = (Alike::of(templates[0].clone()), Outlined::new());
        let (mut cut, mut worst) = (0, 0.0f64);
        for (eight, outlines) in outlines.chunks(WIDTH).enumerate() {
            let entry = |outline| Some(Entry { outline, normal: [0.0; 3], shift_m: 0.5 });
            let entries: Vec<_> = outlines.iter().map(|outline| entry(outline.as_slice())).collect();
            alike.push(&entries);
            outlined.push(&entries);
            for place in 0..400 {
                let y_m = f64::from(place) * 0.02 - 4.0;
                for (a, b) in crossings(&alike, eight, y_m).iter().zip(&crossings(&outlined, eight, y_m)) {
                    assert_eq!(a[0].is_nan(), b[0].is_nan());
                    cut += usize::from(!a[0].is_nan());
                    worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(worst, f64::max);
                }
            }
        }
        assert!(cut > 1_000 && worst < 1e-9, "{cut} cut, {worst} m");
    }

    #[test]
    fn few_leaves_of_a_kind_and_triangles_have_no_template() {
        let square = |n: f64| vec![[n, 0.0, 0.0], [n, 1.0, 0.0], [n, 1.5, 0.5], [n, 1.0, 1.0], [n, 0.0, 1.0]];
        let few: Vec<Vec<[f64; 3]>> = (0..20).map(|n| square(f64::from(n))).collect();
        let triangles: Vec<Vec<[f64; 3]>> = few.iter().cycle().take(100).map(|v| v[..3].to_vec()).collect();
        for outlines in [few, triangles] {
            let (templates, of) = Template::among(&outlines);
            assert!(templates.is_empty() && of.iter().all(Option::is_none));
        }
    }
}
