//! Leaves as convex pieces with their labels, before they are sorted: some bytes a leaf, for the caster may hold millions.

use rayon::prelude::*;

use super::convex;
use super::row_index::{self, YExtent};
use super::tag::{Label, Tag};
use crate::organ::Leaf;

/// Leaves that are looked at side by side.
const CHUNK: usize = 1 << 14;

/// Convex pieces of leaves.
pub(super) struct Pieces<'a> {
    leaves: Vec<&'a Leaf>,
    labels: Vec<Label>,
    /// Outlines that are not those of whole leaves.
    parts: Vec<Box<[[f64; 3]]>>,
    pieces: Vec<Piece>,
    period_m: f64,
}

/// Whose a piece is, and which part, if it is not the whole leaf.
#[derive(Clone, Copy)]
struct Piece {
    leaf: u32,
    part: u32,
}

/// The part of a piece that is a whole leaf.
const WHOLE: u32 = u32::MAX;

/// A piece, and how many periods along the row its image lies.
#[derive(Clone, Copy)]
pub(super) struct Image {
    piece: u32,
    periods: i32,
}

/// Images, and what each takes up along the row.
pub(super) struct Placed {
    pub(super) images: Vec<Image>,
    pub(super) extents: Vec<YExtent>,
}

impl<'a> Pieces<'a> {
    /// All pieces of leaves, in their order, in a row that repeats after `period_m`.
    pub(super) fn new(leaves: impl Iterator<Item = (Label, &'a Leaf)>, period_m: f64) -> Self {
        let (labels, leaves): (Vec<Label>, Vec<&Leaf>) = leaves.unzip();
        let cut: Vec<Vec<_>> = leaves
            .par_chunks(CHUNK)
            .map(|leaves| leaves.iter().map(|leaf| convex::parts(leaf)).collect())
            .collect();
        let (mut parts, mut pieces) = (Vec::new(), Vec::with_capacity(leaves.len()));
        for (leaf, cut) in (0..).zip(cut.into_iter().flatten()) {
            match cut {
                None => pieces.push(Piece { leaf, part: WHOLE }),
                Some(cut) => {
                    for outline in cut {
                        pieces.push(Piece { leaf, part: parts.len() as u32 });
                        parts.push(outline.into_boxed_slice());
                    }
                }
            }
        }
        Self { leaves, labels, parts, pieces, period_m }
    }

    /// The outlines of all pieces.
    pub(super) fn outlines(&self) -> Vec<&[[f64; 3]]> {
        self.pieces.iter().map(|piece| self.of(*piece)).collect()
    }

    /// The images that reach into the row of those pieces that are of kind `kind`, by the kinds of all.
    pub(super) fn placed(&self, kind: Option<u8>, kinds: &[Option<u8>]) -> Placed {
        let chunks: Vec<Vec<(Image, YExtent)>> = (0..self.pieces.len().div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let numbers = chunk * CHUNK..((chunk + 1) * CHUNK).min(self.pieces.len());
                numbers
                    .filter(|number| kinds.get(*number).is_some_and(|of| *of == kind))
                    .flat_map(|number| self.images(number as u32))
                    .collect()
            })
            .collect();
        let count = chunks.iter().map(Vec::len).sum();
        let mut placed = Placed { images: Vec::with_capacity(count), extents: Vec::with_capacity(count) };
        for (image, extent) in chunks.into_iter().flatten() {
            placed.images.push(image);
            placed.extents.push(extent);
        }
        placed
    }

    fn images(&self, number: u32) -> impl Iterator<Item = (Image, YExtent)> {
        let image = Image { piece: number, periods: 0 };
        let extent = YExtent::around(self.outline(image).iter().map(|[_, y, _]| *y));
        extent.periods(self.period_m).map(move |periods| {
            // What lies more periods away than that is met by nothing.
            let image = Image { periods: periods.clamp(i32::MIN.into(), i32::MAX.into()) as i32, ..image };
            (image, extent.moved(self.shift_m(image)))
        })
    }

    /// How far an image lies along the row from its piece.
    pub(super) fn shift_m(&self, image: Image) -> f64 {
        row_index::shift_m(image.periods.into(), self.period_m)
    }

    /// The piece's outline, where it was made.
    pub(super) fn outline(&self, image: Image) -> &[[f64; 3]] {
        self.pieces.get(image.piece as usize).map_or(&[], |piece| self.of(*piece))
    }

    /// The normal of its leaf.
    pub(super) fn normal(&self, image: Image) -> [f64; 3] {
        self.leaf(image).map_or([0.0; 3], |leaf| leaf.normal())
    }

    /// What it is.
    pub(super) fn tag(&self, image: Image) -> Tag {
        let label =
            self.pieces.get(image.piece as usize).and_then(|piece| self.labels.get(piece.leaf as usize));
        label.map_or(Tag::NOTHING, |label| Tag::polygon(*label, self.normal(image)))
    }

    /// Drops the labels: no tag is asked for any more.
    pub(super) fn forget_labels(&mut self) {
        self.labels = Vec::new();
    }

    fn of(&self, Piece { leaf, part }: Piece) -> &[[f64; 3]] {
        match self.parts.get(part as usize) {
            Some(part) => part,
            None => self.leaves.get(leaf as usize).map_or(&[], |leaf| leaf.outline()),
        }
    }

    fn leaf(&self, image: Image) -> Option<&'a Leaf> {
        self.leaves.get(self.pieces.get(image.piece as usize)?.leaf as usize).copied()
    }
}
