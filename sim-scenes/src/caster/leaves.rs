//! The leaf kernel: polygon ∩ scan plane = a segment; a segment covers a run of beams. Eight leaves at a time are cut, eight beams at a
//! time are covered.

use pulp::{Simd, WithSimd};

use super::leaf_field::Kind;
use super::leaf_pass::{BATCH, Edges, End, Form, LeafPass, edges, fetch};
use super::moving;
use super::nearest::marked;
use super::shapes::{Leaves, Shapes};
use super::sight::{Cut, Points, Segments, Sight};
use super::spans::for_beams;
use super::turned::{Frame, Turned};
use crate::lanes::{Lanes, Row, WIDTH};

/// Leaves whose plane is nearer than this to the scan plane (sine of the angle) are edge-on and return nothing.
const PARALLEL: f64 = 1e-12;

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

/// Eight leaves cut by the line's plane. False if it cuts none.
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
        let cut = if T::LEANS {
            register(simd, Turned::new(Frame::of(simd, sight.axes()), leaves))
        } else {
            register(simd, leaves)
        };
        any |= !cut.cut.is_empty();
        sight.segments(simd, part, cut, out);
    }
    any
}

/// A register of leaves cut by the plane Y = 0.
#[inline(always)]
fn register<S: Simd, L: Leaves<S>>(simd: S, leaves: L) -> Cut<S> {
    let Edges { rise, fall, cut } = edges(leaves, Lanes::splat(simd, 0.0));
    let (normal, on) = leaves.planes();
    let facing = (normal.y.abs() * normal.y.of(PARALLEL)).le(normal.x.abs().max(normal.z.abs()));
    Cut {
        a: crossing(leaves, rise),
        b: crossing(leaves, fall),
        normal: Points(normal.x, normal.z),
        distance: normal.dot(on),
        cut: cut.and(facing),
    }
}

/// Where edges cross the plane. Always from the lower end, so that two pieces that share an edge share the crossing to the last bit.
#[inline(always)]
fn crossing<S: Simd, L: Leaves<S>>(leaves: L, [low, high]: [End<S, L::At>; 2]) -> Points<S> {
    let at = leaves.placed(L::between(low.at, high.at, low.above / (low.above - high.above)));
    Points(at.x, at.z)
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
    use rayon::prelude::*;

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
        let entry = |outline| Some(Entry { outline, normal: [0.0; 3], shift_m: 0.5 });
        let eights: Vec<[_; WIDTH]> = outlines
            .chunks(WIDTH)
            .map(|eight| std::array::from_fn(|lane| entry(eight.get(lane)?.as_slice())))
            .collect();
        let alike = Alike::of(templates[0].clone(), eights.clone().into_par_iter());
        let outlined = Outlined::of(eights.iter().copied());
        let (mut cut, mut worst) = (0, 0.0f64);
        for eight in 0..eights.len() {
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
