//! What is cut as one: the organs of a row, or of one distinct tree that stands in many places.

use super::leaf_field::LeafField;
use super::returns::{Class, Return};
use super::tag::Label;
use super::wood_field::WoodField;
use crate::organ::{Facet, Tree};
use crate::support::Support;

/// Leaves, wood and facets, each sorted along the row.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    pub(super) leaves: Vec<LeafField>,
    pub(super) wood: WoodField,
    pub(super) facets: Vec<LeafField>,
}

impl Block {
    /// The organs of trees, by number, of supports and of the ground; images over the border of the period included.
    pub(super) fn new<'a>(
        trees: impl Iterator<Item = (u32, &'a Tree)> + Clone,
        supports: &[Support],
        ground: &[Facet],
        period_m: f64,
    ) -> Self {
        let leaves = trees.clone().flat_map(|(tree, organs)| {
            (0..)
                .zip(&organs.leaves)
                .map(move |(organ, leaf)| (Label { tree, organ, class: Class::Leaf }, leaf))
        });
        let wood = trees.clone().flat_map(|(tree, organs)| {
            (0..)
                .zip(&organs.wood)
                .map(move |(organ, piece)| (Label { tree, organ, class: Class::Wood }, piece))
        });
        let built = (0..).zip(supports).map(|(organ, support)| {
            (Label { tree: Return::NO_LABEL, organ, class: support.kind.into() }, &support.shape)
        });
        // Facets count on where branches end.
        let facets = trees.flat_map(|(tree, organs)| {
            let first = organs.wood.len() as u32;
            (first..).zip(&organs.facets).map(move |(organ, facet)| {
                (Label { tree, organ, class: facet.surface.into() }, &facet.polygon)
            })
        });
        let ground = ground.iter().map(|facet| (Label::of_nobody(facet.surface.into()), &facet.polygon));
        let facets = facets.chain(ground);
        Self {
            leaves: LeafField::by_kind(leaves, period_m),
            wood: WoodField::new(wood.chain(built), period_m),
            facets: LeafField::by_kind(facets, period_m),
        }
    }
}
