//! Leaves that share a template: nine numbers each, however many vertices.

use pulp::Simd;
use rayon::prelude::*;

use super::shapes::{Entry, Leaves, Shapes, Vertex, radius};
use super::sight::Points;
use super::template::{Frame, Template};
use crate::lanes::{Lanes, Mask, Row, WIDTH};

/// Leaves of one template.
#[derive(Clone, Debug)]
pub(super) struct Alike {
    template: Template,
    /// Of eight leaves: three rows of middles, u and v each, and the radii of circles about the middles that hold the leaves as seen
    /// along Y.
    eights: Vec<[Row; 10]>,
}

impl Alike {
    /// Leaves by eights.
    pub(super) fn of<'a>(
        template: Template,
        eights: impl IndexedParallelIterator<Item = [Option<Entry<'a>>; WIDTH]>,
    ) -> Self {
        let eights = eights.map(|eight| Self::rows_of(&template, &eight)).collect();
        Self { template, eights }
    }

    fn rows_of(template: &Template, eight: &[Option<Entry<'_>>; WIDTH]) -> [Row; 10] {
        let mut rows = [Row::splat(0.0); 10];
        for (lane, entry) in eight.iter().enumerate() {
            let Some(Entry { outline, shift_m, .. }) = entry else { continue };
            let Some(Frame { mut middle, u, v }) = template.frame(outline) else { continue };
            let radius = radius(outline, middle.x, middle.z);
            middle.y += shift_m;
            let vectors = [middle, u, v].into_iter().flat_map(|vector| vector.to_array());
            for (row, value) in rows.iter_mut().zip(vectors.chain([radius])) {
                row.0[lane] = value;
            }
        }
        rows
    }
}

impl Shapes for Alike {
    type Leaves<'a, S: Simd> = AlikeLeaves<'a, S>;

    #[inline(always)]
    fn leaves<S: Simd>(
        &self,
        simd: S,
        eight: usize,
        part: usize,
        origin: [f64; 3],
    ) -> Option<AlikeLeaves<'_, S>> {
        let ([middle, u, v], [radius]) = self.rows(eight).as_chunks::<3>() else { return None };
        Some(AlikeLeaves {
            simd,
            shares: &self.template.shares,
            middle: Vertex::load(simd, part, middle).from(Vertex::splat(simd, origin)),
            u: Vertex::load(simd, part, u),
            v: Vertex::load(simd, part, v),
            radius: radius.load(simd, part),
        })
    }

    #[inline(always)]
    fn rows(&self, eight: usize) -> &[Row] {
        self.eights.get(eight).map_or(&[], |rows| rows)
    }

    fn outline(&self, eight: usize, lane: usize) -> impl Iterator<Item = [f64; 3]> + Clone {
        let rows = self.rows(eight).as_chunks::<3>().0;
        self.template.shares.iter().filter_map(move |[a, b]| {
            let [middle, u, v] = rows else { return None };
            let at = |row: &Row| row.0[lane % WIDTH];
            Some(std::array::from_fn(|i| at(&middle[i]) + a * at(&u[i]) + b * at(&v[i])))
        })
    }
}

/// A register of leaves of one template. A vertex is at its shares of u and v.
#[derive(Clone, Copy)]
pub(super) struct AlikeLeaves<'a, S: Simd> {
    simd: S,
    shares: &'a [[f64; 2]],
    middle: Vertex<S>,
    u: Vertex<S>,
    v: Vertex<S>,
    radius: Lanes<S>,
}

impl<S: Simd> Leaves<S> for AlikeLeaves<'_, S> {
    type At = (Lanes<S>, Lanes<S>);

    #[inline(always)]
    fn vertices(self) -> usize {
        self.shares.len()
    }

    #[inline(always)]
    fn at(self, vertex: usize) -> Self::At {
        let [a, b] = self.shares[vertex];
        (Lanes::splat(self.simd, a), Lanes::splat(self.simd, b))
    }

    #[inline(always)]
    fn y(self, (a, b): Self::At) -> Lanes<S> {
        self.middle.y + a * self.u.y + b * self.v.y
    }

    #[inline(always)]
    fn placed(self, at: Self::At) -> Vertex<S> {
        let (a, b) = at;
        Vertex {
            x: self.middle.x + a * self.u.x + b * self.v.x,
            y: self.y(at),
            z: self.middle.z + a * self.u.z + b * self.v.z,
        }
    }

    #[inline(always)]
    fn select(mask: Mask<S>, yes: Self::At, no: Self::At) -> Self::At {
        (mask.select(yes.0, no.0), mask.select(yes.1, no.1))
    }

    #[inline(always)]
    fn between(low: Self::At, high: Self::At, share: Lanes<S>) -> Self::At {
        (low.0 + share * (high.0 - low.0), low.1 + share * (high.1 - low.1))
    }

    #[inline(always)]
    fn planes(self) -> (Vertex<S>, Vertex<S>) {
        (self.u.cross(self.v), self.middle)
    }

    #[inline(always)]
    fn circles(self) -> (Points<S>, Lanes<S>) {
        (Points(self.middle.x, self.middle.z), self.radius)
    }
}
