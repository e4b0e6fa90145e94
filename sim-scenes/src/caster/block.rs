//! What is cut as one: the organs of a row, or of one distinct tree that stands in many places.

use std::collections::BTreeMap;

use glam::DVec3;

use super::leaves::{Label, LeafField};
use super::returns::{Class, Return};
use super::wood::WoodField;
use crate::organ::{Surface, Tree};
use crate::support::{Support, SupportKind};

/// Leaves, wood and facets, each sorted along the row. Owners count through them in this order.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    pub(super) leaves: LeafField,
    pub(super) wood: WoodField,
    pub(super) facets: LeafField,
    /// What each entry of the facets is.
    surfaces: Vec<Class>,
    supports: Vec<Class>,
}

/// What an owner is.
pub(super) enum Found {
    /// A polygon, with |beam · normal|.
    Polygon(Class, Label, f32),
    /// A cylinder; the floor knows the cosine.
    Cylinder(Class, Label),
}

impl Block {
    /// The organs of trees, by number, and of supports; images over the border of the period included.
    pub(super) fn new<'a>(
        trees: impl Iterator<Item = (u32, &'a Tree)> + Clone,
        supports: &[Support],
        period_m: f64,
    ) -> Self {
        let leaves = trees.clone().flat_map(|(tree, organs)| {
            (0..).zip(&organs.leaves).map(move |(organ, leaf)| (Label { tree, organ }, leaf))
        });
        let wood = trees.clone().flat_map(|(tree, organs)| {
            (0..).zip(&organs.wood).map(move |(organ, piece)| (Label { tree, organ }, piece))
        });
        let built = (0..)
            .zip(supports)
            .map(|(organ, support)| (Label { tree: Return::NO_LABEL, organ }, &support.shape));
        // Facets count on where branches end.
        let facets = trees.flat_map(|(tree, organs)| {
            let first = organs.wood.len() as u32;
            (first..).zip(&organs.facets).map(move |(organ, facet)| (Label { tree, organ }, facet))
        });
        let kinds: BTreeMap<(u32, u32), Class> = facets
            .clone()
            .map(|(Label { tree, organ }, facet)| ((tree, organ), class_of_surface(facet.surface)))
            .collect();
        let facets = LeafField::new(facets.map(|(label, facet)| (label, &facet.polygon)), period_m);
        let surfaces = (0..facets.len())
            .map(|entry| {
                let Label { tree, organ } = facets.tag(entry, DVec3::ZERO)?.0;
                kinds.get(&(tree, organ)).copied()
            })
            .map(Option::unwrap_or_default)
            .collect();
        Self {
            leaves: LeafField::new(leaves, period_m),
            wood: WoodField::new(wood.chain(built), period_m),
            facets,
            surfaces,
            supports: supports.iter().map(|support| class_of_support(support.kind)).collect(),
        }
    }

    /// First owner that is wood, and first that is a facet, counted from the block's own first.
    pub(super) fn borders(&self) -> (usize, usize) {
        let wood = self.leaves.len();
        (wood, wood + self.wood.len())
    }

    /// Number of owners.
    pub(super) fn len(&self) -> usize {
        self.borders().1 + self.facets.len()
    }

    /// What owner `entry` is, for a beam in `direction`.
    #[inline(always)]
    pub(super) fn found(&self, entry: usize, direction: DVec3) -> Option<Found> {
        if let Some((label, cos)) = self.leaves.tag(entry, direction) {
            return Some(Found::Polygon(Class::Leaf, label, cos));
        }
        let (wood, facets) = self.borders();
        if entry < facets {
            let label = self.wood.label(entry - wood)?;
            let built = || self.supports.get(label.organ as usize).copied();
            let class = if label.tree == Return::NO_LABEL { built()? } else { Class::Wood };
            return Some(Found::Cylinder(class, label));
        }
        let (label, cos) = self.facets.tag(entry - facets, direction)?;
        Some(Found::Polygon(*self.surfaces.get(entry - facets)?, label, cos))
    }
}

fn class_of_surface(surface: Surface) -> Class {
    match surface {
        Surface::Bark => Class::Wood,
        Surface::Fruit => Class::Fruit,
        Surface::Post => Class::Post,
        Surface::Wire => Class::Wire,
    }
}

pub(super) fn class_of_support(kind: SupportKind) -> Class {
    match kind {
        SupportKind::Post => Class::Post,
        SupportKind::Wire => Class::Wire,
    }
}
