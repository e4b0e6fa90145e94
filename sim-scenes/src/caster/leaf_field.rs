//! Leaves as the caster keeps them: convex pieces, eight side by side.

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
    outline: Vec<[f64; 3]>,
}

impl AsRef<[[f64; 3]]> for Piece<'_> {
    fn as_ref(&self) -> &[[f64; 3]] {
        &self.outline
    }
}

impl LeafField {
    /// The leaves by the templates they share, and those that share none.
    pub(super) fn by_kind<'a>(leaves: impl Iterator<Item = (Label, &'a Leaf)>, period_m: f64) -> Vec<Self> {
        let pieces: Vec<Piece<'_>> = leaves
            .flat_map(|(label, leaf)| {
                convex::pieces(leaf).into_iter().map(move |outline| Piece { label, leaf, outline })
            })
            .collect();
        let (templates, of) = Template::among(&pieces);
        let kinds =
            (0..).zip(templates).map(|(number, template)| (Some(number), Kind::Alike(Alike::of(template))));
        let fields = kinds.chain([(None, Kind::Outlined(Outlined::new()))]).map(|(number, kind)| {
            let own = pieces.iter().zip(&of).filter(|(_, of)| **of == number);
            Self::of(kind, own.map(|(piece, _)| piece), period_m)
        });
        fields.filter(|field| !field.tags.is_empty()).collect()
    }

    fn of<'a>(kind: Kind, pieces: impl Iterator<Item = &'a Piece<'a>>, period_m: f64) -> Self {
        let (mut images, mut extents): (Vec<(&Piece<'_>, f64)>, Vec<YExtent>) = (Vec::new(), Vec::new());
        for piece in pieces {
            let extent = YExtent::around(piece.outline.iter().map(|[_, y, _]| *y));
            for shift in extent.images(period_m) {
                images.push((piece, shift));
                extents.push(YExtent { from_m: extent.from_m + shift, to_m: extent.to_m + shift });
            }
        }
        let (index, order) = RowIndex::new(&extents);
        let mut field = Self { index, tags: Vec::with_capacity(order.len()), kind };
        for eight in order.chunks(WIDTH) {
            let image = |lane: usize| images.get((*eight.get(lane)?)?);
            let entries: [_; WIDTH] = std::array::from_fn(|lane| {
                let (piece, shift_m) = *image(lane)?;
                Some(Entry { outline: &piece.outline, normal: piece.leaf.normal(), shift_m })
            });
            match &mut field.kind {
                Kind::Alike(alike) => alike.push(&entries),
                Kind::Outlined(outlined) => outlined.push(&entries),
            }
            field.tags.extend((0..WIDTH).map(|lane| {
                image(lane).map_or(Tag::NOTHING, |(piece, _)| Tag::polygon(piece.label, piece.leaf.normal()))
            }));
        }
        field
    }

    /// What eight entries are.
    #[inline(always)]
    pub(super) fn tags(&self, eight: usize) -> &[Tag] {
        self.tags.get(eight * WIDTH..(eight + 1) * WIDTH).unwrap_or(&[])
    }
}
