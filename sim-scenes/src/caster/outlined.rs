//! Leaves by their own vertices: pieces of leaves that are not convex, triangles of meshes, outlines that few others have.

use pulp::Simd;

use super::shapes::{Entry, Leaves, Shapes, Vertex, radius};
use super::sight::Points;
use crate::lanes::{Lanes, Mask, Row, WIDTH};

/// Leaves by their own vertices.
#[derive(Clone, Debug)]
pub(super) struct Outlined {
    /// Where the values of each eight start; one more than those.
    starts: Vec<usize>,
    /// Of eight leaves: three rows of normals, three of circles (middle X and Z, radius) that hold the leaves as seen along Y, then
    /// three rows of coordinates for every vertex. Leaves with fewer vertices than others of their eight repeat the last one, so that
    /// the edges between are crossed by no plane.
    values: Vec<Row>,
}

impl Outlined {
    /// Leaves by eights.
    pub(super) fn of<'a>(eights: impl ExactSizeIterator<Item = [Option<Entry<'a>>; WIDTH]> + Clone) -> Self {
        let mut field = Self { starts: Vec::with_capacity(eights.len() + 1), values: Vec::new() };
        field.values.reserve_exact(eights.clone().map(|eight| rows_of(&eight)).sum());
        field.starts.push(0);
        for eight in eights {
            field.push(&eight);
        }
        field
    }

    /// Adds eight leaves.
    fn push(&mut self, eight: &[Option<Entry<'_>>; WIDTH]) {
        let (start, count) = (self.values.len(), rows_of(eight));
        self.values.resize(start + count, Row::splat(0.0));
        let vertices = (count - HEAD) / 3;
        let rows = self.values.get_mut(start..).unwrap_or_default();
        for (lane, entry) in eight.iter().enumerate() {
            let Some(Entry { outline, normal, shift_m }) = entry else { continue };
            let shifted = outline.iter().map(|[x, y, z]| [*x, y + shift_m, *z]);
            let last = shifted.clone().next_back().unwrap_or_default();
            let filled = shifted.chain(std::iter::repeat(last)).take(vertices);
            let headed = [*normal, circle(outline)].into_iter().chain(filled);
            for (row, value) in rows.iter_mut().zip(headed.flatten()) {
                row.0[lane] = value;
            }
        }
        self.starts.push(self.values.len());
    }

    #[inline(always)]
    fn eight(&self, eight: usize) -> &[[Row; 3]] {
        self.rows(eight).as_chunks::<3>().0
    }
}

/// Rows of normals and circles.
const HEAD: usize = 6;

/// How many rows eight leaves take.
fn rows_of(eight: &[Option<Entry<'_>>; WIDTH]) -> usize {
    HEAD + 3 * eight.iter().flatten().map(|entry| entry.outline.len()).max().unwrap_or(0)
}

impl Shapes for Outlined {
    type Leaves<'a, S: Simd> = OutlinedLeaves<'a, S>;

    #[inline(always)]
    fn leaves<S: Simd>(
        &self,
        simd: S,
        eight: usize,
        part: usize,
        origin: [f64; 3],
    ) -> Option<OutlinedLeaves<'_, S>> {
        let [normal, circle, vertices @ ..] = self.eight(eight) else { return None };
        Some(OutlinedLeaves { simd, part, origin: Vertex::splat(simd, origin), normal, circle, vertices })
    }

    #[inline(always)]
    fn rows(&self, eight: usize) -> &[Row] {
        let Some(&[from, to]) = self.starts.get(eight..eight + 2) else { return &[] };
        self.values.get(from..to).unwrap_or(&[])
    }

    fn outline(&self, eight: usize, lane: usize) -> impl Iterator<Item = [f64; 3]> + Clone {
        let rows = self.eight(eight).iter().skip(2);
        rows.map(move |[x, y, z]| [x, y, z].map(|row| row.0[lane % WIDTH]))
    }
}

/// A register of leaves by their own vertices.
#[derive(Clone, Copy)]
pub(super) struct OutlinedLeaves<'a, S: Simd> {
    simd: S,
    part: usize,
    origin: Vertex<S>,
    normal: &'a [Row; 3],
    circle: &'a [Row; 3],
    vertices: &'a [[Row; 3]],
}

impl<S: Simd> Leaves<S> for OutlinedLeaves<'_, S> {
    type At = Vertex<S>;

    #[inline(always)]
    fn vertices(self) -> usize {
        self.vertices.len()
    }

    #[inline(always)]
    fn at(self, vertex: usize) -> Vertex<S> {
        Vertex::load(self.simd, self.part, &self.vertices[vertex]).from(self.origin)
    }

    #[inline(always)]
    fn y(self, at: Vertex<S>) -> Lanes<S> {
        at.y
    }

    #[inline(always)]
    fn placed(self, at: Vertex<S>) -> Vertex<S> {
        at
    }

    #[inline(always)]
    fn select(mask: Mask<S>, yes: Vertex<S>, no: Vertex<S>) -> Vertex<S> {
        Vertex::select(mask, yes, no)
    }

    #[inline(always)]
    fn between(low: Vertex<S>, high: Vertex<S>, share: Lanes<S>) -> Vertex<S> {
        Vertex {
            x: low.x + share * (high.x - low.x),
            y: low.y + share * (high.y - low.y),
            z: low.z + share * (high.z - low.z),
        }
    }

    #[inline(always)]
    fn planes(self) -> (Vertex<S>, Vertex<S>) {
        (Vertex::load(self.simd, self.part, self.normal), self.at(0))
    }

    #[inline(always)]
    fn circles(self) -> (Points<S>, Lanes<S>) {
        let Vertex { x, y: z, z: radius } = Vertex::load(self.simd, self.part, self.circle);
        (Points(x - self.origin.x, z - self.origin.z), radius)
    }
}

/// A circle about all vertices as seen along Y: middle X and Z, radius.
fn circle(outline: &[[f64; 3]]) -> [f64; 3] {
    let count = outline.len() as f64;
    let x = outline.iter().map(|[x, ..]| x).sum::<f64>() / count;
    let z = outline.iter().map(|[.., z]| z).sum::<f64>() / count;
    [x, z, radius(outline, x, z)]
}
