//! Leaves as the caster keeps them: convex pieces, eight side by side.

use rayon::prelude::*;

use super::alike::Alike;
use super::convex;
use super::outlined::Outlined;
use super::row_index::{RowIndex, YExtent};
use super::shapes::Entry;
use super::tag::{Label, Tag};
use super::template::Template;
use crate::lanes::WIDTH;
use crate::organ::Leaf;

/// Leaves of one kind as convex pieces, images over the border of the period included, in the order of the row index.
#[derive(Clone, Debug)]
pub(super) struct LeafField {
    pub(super) index: RowIndex,
    /// What each entry is.
    tags: Vec<Tag>,
    pub(super) kind: Kind,
}

/// Where vertices come from.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    Alike(Alike),
    Outlined(Outlined),
}

/// A convex piece of a leaf.
struct Piece<'a> {
    label: Label,
    leaf: &'a Leaf,
    /// Its outline, where it is not the leaf's.
    part: Option<Box<[[f64; 3]]>>,
}

impl AsRef<[[f64; 3]]> for Piece<'_> {
    fn as_ref(&self) -> &[[f64; 3]] {
        self.part.as_deref().unwrap_or(self.leaf.outline())
    }
}

impl<'a> Piece<'a> {
    fn of(label: Label, leaf: &'a Leaf) -> impl Iterator<Item = Self> {
        let parts = convex::parts(leaf);
        let whole = parts.is_none().then_some(None);
        let parts = parts.into_iter().flatten().map(|part| Some(part.into_boxed_slice()));
        whole.into_iter().chain(parts).map(move |part| Self { label, leaf, part })
    }
}

/// A piece and how far along Y its image lies.
type Image<'a> = (&'a Piece<'a>, f64);

impl LeafField {
    /// The leaves by the templates they share, and those that share none.
    pub(super) fn by_kind<'a>(leaves: impl Iterator<Item = (Label, &'a Leaf)>, period_m: f64) -> Vec<Self> {
        let leaves: Vec<(Label, &Leaf)> = leaves.collect();
        let parts: Vec<Vec<Piece<'_>>> = leaves
            .par_chunks(1 << 14)
            .map(|leaves| leaves.iter().flat_map(|(label, leaf)| Piece::of(*label, leaf)).collect())
            .collect();
        drop(leaves);
        let mut pieces = Vec::with_capacity(parts.iter().map(Vec::len).sum());
        pieces.extend(parts.into_iter().flatten());
        let (templates, of) = Template::among(&pieces);
        let kinds = (0..).zip(templates).map(|(number, template)| (Some(number), Some(template)));
        let fields = kinds.chain([(None, None)]).map(|(number, template)| {
            let own = pieces.iter().zip(&of).filter(|(_, of)| **of == number);
            Self::of(template, own.map(|(piece, _)| piece), period_m)
        });
        fields.filter(|field| !field.tags.is_empty()).collect()
    }

    fn of<'a>(
        template: Option<Template>,
        pieces: impl Iterator<Item = &'a Piece<'a>> + Clone,
        period_m: f64,
    ) -> Self {
        // Nearly every piece has one image.
        let count = pieces.clone().count();
        let (mut images, mut extents): (Vec<Image<'a>>, Vec<YExtent>) =
            (Vec::with_capacity(count), Vec::with_capacity(count));
        for piece in pieces {
            let extent = YExtent::around(piece.as_ref().iter().map(|[_, y, _]| *y));
            for shift in extent.images(period_m) {
                images.push((piece, shift));
                extents.push(extent.moved(shift));
            }
        }
        let (index, order) = RowIndex::new(&extents);
        drop(extents);
        let image = |number: Option<u32>| images.get(number? as usize);
        let eight = |numbers: &[Option<u32>]| -> [Option<Entry<'_>>; WIDTH] {
            std::array::from_fn(|lane| {
                let (piece, shift_m) = *image(*numbers.get(lane)?)?;
                Some(Entry { outline: piece.as_ref(), normal: piece.leaf.normal(), shift_m })
            })
        };
        let kind = match template {
            Some(template) => Kind::Alike(Alike::of(template, order.par_chunks(WIDTH).map(eight))),
            None => Kind::Outlined(Outlined::of(order.chunks(WIDTH).map(eight))),
        };
        let tag = |(piece, _): &Image<'_>| Tag::polygon(piece.label, piece.leaf.normal());
        let tags = order.par_iter().map(|number| image(*number).map_or(Tag::NOTHING, tag)).collect();
        Self { index, tags, kind }
    }

    /// What eight entries are.
    #[inline(always)]
    pub(super) fn tags(&self, eight: usize) -> &[Tag] {
        self.tags.get(eight * WIDTH..(eight + 1) * WIDTH).unwrap_or(&[])
    }
}
