//! Leaves as the caster keeps them: convex pieces, eight side by side.

use rayon::prelude::*;

use super::alike::Alike;
use super::outlined::Outlined;
use super::pieces::{Image, Pieces, Placed};
use super::row_index::RowIndex;
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

/// Leaves of one kind, sorted.
struct Sorted {
    template: Option<Template>,
    images: Vec<Image>,
    /// Entry by entry, which image it is; beyond all of them where an eight is filled up.
    order: Vec<u32>,
    index: RowIndex,
}

impl LeafField {
    /// The leaves by the templates they share, and those that share none.
    pub(super) fn by_kind<'a>(leaves: impl Iterator<Item = (Label, &'a Leaf)>, period_m: f64) -> Vec<Self> {
        let mut pieces = Pieces::new(leaves, period_m);
        let (templates, kinds) = Template::among(&pieces.outlines());
        let templates = (0..).zip(templates).map(|(number, template)| (Some(number), Some(template)));
        let sorted: Vec<Sorted> = templates
            .chain([(None, None)])
            .map(|(kind, template)| Sorted::of(template, pieces.placed(kind, &kinds)))
            .filter(|sorted| !sorted.images.is_empty())
            .collect();
        drop(kinds);
        // What is needed for less is let go before more is made.
        let tags: Vec<Vec<Tag>> = sorted.iter().map(|sorted| sorted.tags(&pieces)).collect();
        pieces.forget_labels();
        sorted.into_iter().zip(tags).map(|(sorted, tags)| sorted.field(&pieces, tags)).collect()
    }

    /// What eight entries are.
    #[inline(always)]
    pub(super) fn tags(&self, eight: usize) -> &[Tag] {
        self.tags.get(eight * WIDTH..(eight + 1) * WIDTH).unwrap_or(&[])
    }
}

impl Sorted {
    fn of(template: Option<Template>, placed: Placed) -> Self {
        let Placed { images, extents } = placed;
        let (index, order) = RowIndex::new(&extents);
        Self { template, images, order, index }
    }

    /// The images of an eight.
    fn eight(&self, numbers: &[u32]) -> [Option<Image>; WIDTH] {
        std::array::from_fn(|lane| self.images.get(*numbers.get(lane)? as usize).copied())
    }

    fn tags(&self, pieces: &Pieces<'_>) -> Vec<Tag> {
        let image = |number: &u32| self.images.get(*number as usize);
        let tag = |number: &u32| image(number).map_or(Tag::NOTHING, |image| pieces.tag(*image));
        self.order.par_iter().map(tag).collect()
    }

    fn field(mut self, pieces: &Pieces<'_>, tags: Vec<Tag>) -> LeafField {
        let template = self.template.take();
        let entry = |image: Image| Entry {
            outline: pieces.outline(image),
            normal: pieces.normal(image),
            shift_m: pieces.shift_m(image),
        };
        let eight = |numbers: &[u32]| self.eight(numbers).map(|image| image.map(entry));
        let kind = match template {
            Some(template) => Kind::Alike(Alike::of(template, self.order.par_chunks(WIDTH).map(eight))),
            None => Kind::Outlined(Outlined::of(self.order.chunks(WIDTH).map(eight))),
        };
        LeafField { index: self.index, tags, kind }
    }
}
