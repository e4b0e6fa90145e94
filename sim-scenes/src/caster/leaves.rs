//! The leaf kernel: polygon ∩ scan plane = a segment; a segment covers a run of beams. Eight leaves at a time are cut, eight beams at a
//! time are covered.

use glam::DVec3;
use pulp::{Simd, WithSimd};

use super::convex;
use super::lanes::{Lanes, Mask, Row, WIDTH};
use super::moving;
use super::nearest::{Nearest, insert};
use super::row_index::{Extent, RowIndex};
use super::sight::{Cut, Part, Points, Segments, Sight, Turning};
use crate::organ::Leaf;

/// Leaves whose plane is nearer than this to the scan plane (sine of the angle) are edge-on and return nothing.
const PARALLEL: f64 = 1e-12;

/// Whose organ an entry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Label {
    pub(super) tree: u32,
    pub(super) organ: u32,
}

/// What a return needs to know of a leaf: its label and its normal in (X, Z).
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
struct Tag {
    label: Label,
    normal: [f32; 2],
}

/// All leaves of an orchard as convex pieces, images over the border of the period included, in the order of the row index.
#[derive(Clone, Debug, Default)]
pub(super) struct LeafField {
    index: RowIndex,
    tags: Vec<Tag>,
    /// Where the values of each eight entries start; one more than those.
    starts: Vec<usize>,
    /// Of eight entries: three rows of normals, three of circles (middle X and Z, radius) that hold the
    /// leaves as seen along Y, then three rows of coordinates for every vertex. Entries with fewer vertices than
    /// others of their eight repeat the last one, so that the edges between are crossed by no plane.
    values: Vec<Row>,
}

/// A convex piece of a leaf.
struct Piece<'a> {
    label: Label,
    leaf: &'a Leaf,
    outline: Vec<[f64; 3]>,
}

impl LeafField {
    pub(super) fn new<'a>(leaves: impl Iterator<Item = (Label, &'a Leaf)>, period_m: f64) -> Self {
        let pieces: Vec<Piece<'_>> = leaves
            .flat_map(|(label, leaf)| {
                convex::pieces(leaf).into_iter().map(move |outline| Piece { label, leaf, outline })
            })
            .collect();
        let mut images: Vec<(&Piece<'_>, f64)> = Vec::with_capacity(pieces.len());
        let mut extents: Vec<Extent> = Vec::with_capacity(pieces.len());
        for piece in &pieces {
            let extent = Extent::around(piece.outline.iter().map(|[_, y, _]| *y));
            for shift in extent.images(period_m) {
                images.push((piece, shift));
                extents.push(Extent { from_m: extent.from_m + shift, to_m: extent.to_m + shift });
            }
        }
        let (index, order) = RowIndex::new(&extents);
        let mut field = Self { index, starts: vec![0], ..Self::default() };
        for eight in order.chunks(WIDTH) {
            let eight: Vec<Option<&(&Piece<'_>, f64)>> =
                eight.iter().map(|number| number.and_then(|number| images.get(number))).collect();
            field.push(&eight);
        }
        field
    }

    fn push(&mut self, eight: &[Option<&(&Piece<'_>, f64)>]) {
        let outline_of =
            |entry: &Option<&(&Piece<'_>, f64)>| entry.map_or(0, |(piece, _)| piece.outline.len());
        let vertices = eight.iter().map(outline_of).max().unwrap_or(0);
        let mut rows = vec![Row::splat(0.0); 6 + 3 * vertices];
        for (lane, entry) in eight.iter().enumerate() {
            let Some((piece, shift)) = entry else {
                self.tags.push(Tag { label: Label { tree: u32::MAX, organ: u32::MAX }, normal: [0.0; 2] });
                continue;
            };
            let normal = piece.leaf.normal();
            self.tags.push(Tag { label: piece.label, normal: [normal[0] as f32, normal[2] as f32] });
            let shifted = piece.outline.iter().map(|[x, y, z]| [*x, y + shift, *z]);
            let last = shifted.clone().next_back().unwrap_or_default();
            let filled = shifted.chain(std::iter::repeat(last)).take(vertices);
            for (row, value) in
                rows.iter_mut().zip([normal, circle(&piece.outline)].into_iter().chain(filled).flatten())
            {
                row.0[lane] = value;
            }
        }
        self.values.extend(rows);
        self.starts.push(self.values.len());
    }

    /// The values of eight entries.
    #[inline(always)]
    pub(super) fn eight(&self, eight: usize) -> Option<&[Row]> {
        let &[from, to] = self.starts.get(eight..eight + 2)? else { return None };
        self.values.get(from..to)
    }

    /// Numbers of the eights that may hold entries anywhere in [low, high] along Y.
    pub(super) fn eights(&self, (low_m, high_m): (f64, f64)) -> impl Iterator<Item = usize> + '_ {
        self.index.rows(low_m, high_m).flatten()
    }

    /// Number of entries; owners below it are leaves.
    pub(super) fn len(&self) -> usize {
        self.tags.len()
    }

    /// Label of an entry and |direction · normal| there.
    #[inline(always)]
    pub(super) fn tag(&self, entry: usize, direction: DVec3) -> Option<(Label, f32)> {
        let Tag { label, normal: [x, z] } = self.tags.get(entry)?;
        Some((*label, (x * direction.x as f32 + z * direction.z as f32).abs()))
    }
}

/// A circle about all vertices as seen along Y: middle X and Z, radius.
fn circle(outline: &[[f64; 3]]) -> [f64; 3] {
    let count = outline.len() as f64;
    let x = outline.iter().map(|[x, ..]| x).sum::<f64>() / count;
    let z = outline.iter().map(|[.., z]| z).sum::<f64>() / count;
    let radius = outline.iter().map(|v| (v[0] - x).hypot(v[2] - z)).fold(0.0, f64::max);
    [x, z, radius * (1.0 + 1e-9) + 1e-12]
}

/// Enters every leaf that the plane of a line cuts, or that a moving scanner's beams meet.
pub(super) struct LeafPass<'a, T> {
    pub(super) field: &'a LeafField,
    pub(super) sight: &'a T,
    pub(super) part: Part,
    /// Owners are counted from here.
    pub(super) first_owner: usize,
    pub(super) nearest: &'a mut Nearest,
}

impl<T: Sight> WithSimd for LeafPass<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if self.sight.advance_m() != 0.0 {
            return moving::pass(self, simd);
        }
        // The usual depths get loops of a known length.
        match self.nearest.depth() {
            1 => self.pass(simd, 1),
            3 => self.pass(simd, 3),
            depth => self.pass(simd, depth),
        }
    }
}

impl<T: Sight> LeafPass<'_, T> {
    #[inline(always)]
    fn pass<S: Simd>(self, simd: S, depth: usize) {
        let Self { field, sight, part, first_owner, nearest } = self;
        let (p, q) = sight.parameters();
        let mut segments = Segments::NONE;
        let turning = Turning::of(sight);
        for eights in field.index.rows(part.y_m.0, part.y_m.1) {
            for eight in eights {
                let Some(values) = field.eight(eight) else { continue };
                cut(simd, values, part.origin, sight, &mut segments);
                for lane in 0..WIDTH {
                    let owner = (first_owner + eight * WIDTH + lane) as f64;
                    let mut runs = turning.runs::<WIDTH>(segments.low.0[lane], segments.high.0[lane]);
                    while let Some(rows) = runs.next() {
                        let (Some(p), Some(q)) = (p.get(rows.clone()), q.get(rows.clone())) else { continue };
                        let (keys, owners) = nearest.slots(rows.start, rows.end);
                        cover(simd, &segments, lane, owner, (p, q), (keys, owners), depth);
                    }
                }
            }
        }
    }
}

/// Eight leaves cut by the plane y = `origin[1]`.
///
/// Convex, so the outline rises through the plane once and falls through it once. A vertex on the plane counts as below it.
#[inline(always)]
fn cut<S: Simd, T: Sight>(simd: S, values: &[Row], origin: [f64; 3], sight: &T, out: &mut Segments) {
    let Some((normal, values)) = values.split_first_chunk::<3>() else { return };
    let Some((_circle, vertices)) = values.split_first_chunk::<3>() else { return };
    let (vertices, _) = vertices.as_chunks::<3>();
    let (Some(first), Some(last)) = (vertices.first(), vertices.last()) else { return };
    let [x_m, y_m, z_m] = origin;
    let (x_m, y_m, z_m) = (Lanes::splat(simd, x_m), Lanes::splat(simd, y_m), Lanes::splat(simd, z_m));
    let zero = Lanes::splat(simd, 0.0);
    for part in 0..Row::parts::<S>() {
        let mut from = Vertex::load(simd, part, last);
        let mut from_above = y_m.lt(from.y);
        let mut from_below = from.y.le(y_m);
        // Lower and upper end of the edge that rises and of the one that falls.
        let (mut rise, mut fall) = ([from, from], [from, from]);
        let mut cut = zero.lt(zero);
        for to in vertices {
            let to = Vertex::load(simd, part, to);
            let (to_above, to_below) = (y_m.lt(to.y), to.y.le(y_m));
            let (rises, falls) = (to_above.and(from_below), from_above.and(to_below));
            rise = [Vertex::select(rises, from, rise[0]), Vertex::select(rises, to, rise[1])];
            fall = [Vertex::select(falls, to, fall[0]), Vertex::select(falls, from, fall[1])];
            cut = cut.or(rises);
            (from, from_above, from_below) = (to, to_above, to_below);
        }
        let normal = Vertex::load(simd, part, normal);
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

/// A register of vertices or vectors.
#[derive(Clone, Copy)]
struct Vertex<S: Simd> {
    x: Lanes<S>,
    y: Lanes<S>,
    z: Lanes<S>,
}

impl<S: Simd> Vertex<S> {
    #[inline(always)]
    fn load(simd: S, part: usize, [x, y, z]: &[Row; 3]) -> Self {
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

/// Enters one segment in every beam that meets it: two signs a beam, the first end included, the second not, so that of two segments
/// that share an end exactly one is met.
#[inline(always)]
fn cover<S: Simd>(
    simd: S,
    segments: &Segments,
    lane: usize,
    owner: f64,
    (p, q): (&[Row], &[Row]),
    (keys, owners): (&mut [Row], &mut [Row]),
    depth: usize,
) {
    let key = Form::of(simd, &segments.key, lane);
    let (after, before) = (Form::of(simd, &segments.from, lane), Form::of(simd, &segments.to, lane));
    let (owner, zero) = (Lanes::splat(simd, owner), Lanes::splat(simd, 0.0));
    let slots = keys.chunks_exact_mut(depth).zip(owners.chunks_exact_mut(depth));
    for ((p, q), (keys, owners)) in p.iter().zip(q).zip(slots) {
        for part in 0..Row::parts::<S>() {
            let (p, q) = (p.load(simd, part), q.load(simd, part));
            let met = zero.le(after.at(p, q)).and(zero.lt(before.at(p, q)));
            insert(part, met, key.at(p, q), owner, simd, keys, owners);
        }
    }
}

/// A linear form in (p, q).
struct Form<S: Simd>(Lanes<S>, Lanes<S>);

impl<S: Simd> Form<S> {
    #[inline(always)]
    fn of(simd: S, [a, b]: &[Row; 2], lane: usize) -> Self {
        Self(Lanes::splat(simd, a.0[lane]), Lanes::splat(simd, b.0[lane]))
    }

    #[inline(always)]
    fn at(&self, p: Lanes<S>, q: Lanes<S>) -> Lanes<S> {
        self.0 * p + self.1 * q
    }
}
