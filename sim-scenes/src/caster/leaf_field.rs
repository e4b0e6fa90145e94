//! Leaves as the caster keeps them: convex pieces, eight side by side.

use super::convex;
use super::row_index::{Extent, RowIndex};
use super::tag::{Label, Tag};
use crate::lanes::{Row, WIDTH};
use crate::organ::Leaf;

/// All leaves of an orchard as convex pieces, images over the border of the period included, in the order of the row index.
#[derive(Clone, Debug, Default)]
pub(super) struct LeafField {
    pub(super) index: RowIndex,
    /// What each entry is.
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
            field.tags.extend(eight.iter().map(|entry| {
                entry.map_or(Tag::NOTHING, |(piece, _)| Tag::polygon(piece.label, piece.leaf.normal()))
            }));
        }
        field
    }

    fn push(&mut self, eight: &[Option<&(&Piece<'_>, f64)>]) {
        let outline_of =
            |entry: &Option<&(&Piece<'_>, f64)>| entry.map_or(0, |(piece, _)| piece.outline.len());
        let vertices = eight.iter().map(outline_of).max().unwrap_or(0);
        let mut rows = vec![Row::splat(0.0); 6 + 3 * vertices];
        for (lane, entry) in eight.iter().enumerate() {
            let Some((piece, shift)) = entry else { continue };
            let shifted = piece.outline.iter().map(|[x, y, z]| [*x, y + shift, *z]);
            let last = shifted.clone().next_back().unwrap_or_default();
            let filled = shifted.chain(std::iter::repeat(last)).take(vertices);
            let headed = [piece.leaf.normal(), circle(&piece.outline)].into_iter().chain(filled);
            for (row, value) in rows.iter_mut().zip(headed.flatten()) {
                row.0[lane] = value;
            }
        }
        self.values.extend(rows);
        self.starts.push(self.values.len());
    }

    /// The values of eight entries.
    #[inline(always)]
    pub(super) fn eight(&self, eight: usize) -> Option<Eight<'_>> {
        let &[from, to] = self.starts.get(eight..eight + 2)? else { return None };
        let (normal, values) = self.values.get(from..to)?.split_first_chunk::<3>()?;
        let (circle, values) = values.split_first_chunk::<3>()?;
        Some(Eight { normal, circle, vertices: values.as_chunks::<3>().0 })
    }

    /// What eight entries are.
    #[inline(always)]
    pub(super) fn tags(&self, eight: usize) -> &[Tag] {
        self.tags.get(eight * WIDTH..(eight + 1) * WIDTH).unwrap_or(&[])
    }

    /// True if there is no entry.
    pub(super) fn is_empty(&self) -> bool {
        self.values.is_empty()
    }
}

/// Eight entries of the field.
#[derive(Clone, Copy)]
pub(super) struct Eight<'a> {
    pub(super) normal: &'a [Row; 3],
    pub(super) circle: &'a [Row; 3],
    pub(super) vertices: &'a [[Row; 3]],
}

/// A circle about all vertices as seen along Y: middle X and Z, radius.
fn circle(outline: &[[f64; 3]]) -> [f64; 3] {
    let count = outline.len() as f64;
    let x = outline.iter().map(|[x, ..]| x).sum::<f64>() / count;
    let z = outline.iter().map(|[.., z]| z).sum::<f64>() / count;
    let radius = outline.iter().map(|v| (v[0] - x).hypot(v[2] - z)).fold(0.0, f64::max);
    [x, z, radius * (1.0 + 1e-9) + 1e-12]
}
