//! From places to trees: what happens to a draft whatever made it.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::draft::{Blade, Draft};
use super::error::GrowError;
use super::foliage_shares::FoliageShares;
use super::make::make;
use super::planting::{Generator, Planting};
use super::remark::{MOST_COPIES, Remark};
use crate::growth::TreeParameters;
use crate::growth::fruit;
use crate::growth::prune::{self, Envelope};
use crate::growth::shade::{self, ShadeScope};
use crate::orchard::parameters::OrchardParameters;
use crate::organ::{Cylinder, Leaf, Tree};
use crate::season;
use crate::seed::Purpose;
use crate::support::Support;
use crate::target::{self, Adjustment};

/// The trees of an orchard, and what was done to them.
#[derive(Debug)]
pub(crate) struct Planted {
    /// In the order of the plantings, each where it belongs.
    pub(crate) trees: Vec<Tree>,
    pub(crate) supports: Vec<Support>,
    pub(crate) adjustment: Option<Adjustment>,
    /// None where a generator keeps no seasons.
    pub(crate) foliage: Option<FoliageShares>,
    pub(crate) remarks: Vec<Remark>,
}

/// Makes a tree for every planting. `copies` says how many places each of them fills, for the target leaf area.
pub(crate) fn plant(
    parameters: &OrchardParameters,
    seed: u64,
    plantings: &[Planting],
    copies: &[usize],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Planted, GrowError> {
    let generator = make(parameters, seed)?;
    let young_parameters = parameters.of_replanted();
    let nursery = match plantings.iter().any(|planting| planting.is_young) {
        true => Some(make(&young_parameters, seed)?),
        false => None,
    };
    let tree = parameters.tree_parameters();
    let done = AtomicUsize::new(0);
    let drafts: Vec<Result<Draft, GrowError>> = plantings
        .par_iter()
        .map(|planting| {
            let grower = nursery.as_ref().filter(|_| planting.is_young).unwrap_or(&generator);
            let draft = draft(grower.as_ref(), &tree, planting);
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, plantings.len());
            draft
        })
        .collect();
    // In order, so that the same one of several errors is always reported.
    let mut drafts: Vec<Draft> = drafts.into_iter().collect::<Result<_, _>>()?;
    let is_placed = generator.is_placed();
    if tree.shady_scope == ShadeScope::Orchard {
        thin_together(&mut drafts, plantings, &tree, is_placed);
    }
    let envelope = if generator.is_pruned() { Envelope::of(&tree) } else { None };
    drafts.par_iter_mut().zip(plantings).for_each(|(draft, planting)| {
        prune::cut(draft, envelope.as_ref());
        let mut stream = Purpose::Season.stream(seed, planting.row, planting.tree);
        season::dress(&mut draft.blades, parameters.season, &mut stream);
    });
    let adjustment = match parameters.target_lai {
        None => None,
        Some(lai) => {
            let layout = parameters.layout();
            let places = f64::from(layout.rows) * f64::from(layout.trees);
            let ground_m2 = places * layout.tree_spacing_m * layout.row_spacing_m;
            let keys: Vec<(u32, u32)> =
                plantings.iter().map(|planting| (planting.row, planting.tree)).collect();
            let goal = target::Goal { lai, ground_m2, seed, envelope: envelope.as_ref() };
            Some(target::reach(&mut drafts, &keys, copies, &goal)?)
        }
    };
    let place = |draft: Draft, planting: &Planting| {
        let tree = finish(draft);
        if is_placed { tree } else { tree.moved(planting.base) }
    };
    let supports = drafts
        .iter()
        .zip(plantings)
        .flat_map(|(draft, planting)| draft.supports.iter().map(|support| support.translated(planting.base)))
        .collect();
    let foliage = FoliageShares::of(&drafts, copies);
    // Each draft becomes its tree: leaves are never there twice.
    let trees =
        drafts.into_par_iter().zip(plantings).map(|(draft, planting)| place(draft, planting)).collect();
    let mut remarks = generator.remarks();
    remarks.extend(adjustment.and_then(copies_made));
    Ok(Planted { trees, supports, adjustment, foliage, remarks })
}

/// Leaves that are most of them copies are told.
fn copies_made(Adjustment { target_lai, grown_lai, .. }: Adjustment) -> Option<Remark> {
    (target_lai > MOST_COPIES * grown_lai).then_some(Remark::Copies { target_lai, grown_lai })
}

fn draft(generator: &dyn Generator, tree: &TreeParameters, planting: &Planting) -> Result<Draft, GrowError> {
    if planting.gap {
        return Ok(Draft::default());
    }
    let mut draft = generator.draft(planting)?;
    if tree.shady_scope == ShadeScope::Tree {
        let leaves: Vec<&Leaf> = draft.blades.iter().map(|blade| &blade.leaf).collect();
        let keep = shade::survivors(&leaves, tree);
        draft.retain_blades(keep);
        // Half of the blades of a tree and more have died in the shade.
        draft.blades.shrink_to_fit();
    }
    Ok(draft)
}

/// Shade across trees: every leaf of the orchard where it stands, each once.
fn thin_together(drafts: &mut [Draft], plantings: &[Planting], tree: &TreeParameters, is_placed: bool) {
    let placed: Vec<Leaf> = drafts
        .iter()
        .zip(plantings)
        .flat_map(|(draft, planting)| {
            let base = if is_placed { [0.0; 3] } else { planting.base };
            draft.blades.iter().map(move |blade| blade.leaf.translated(base))
        })
        .collect();
    let mut keep = shade::survivors(&placed.iter().collect::<Vec<_>>(), tree).into_iter();
    for draft in drafts {
        let own: Vec<bool> = keep.by_ref().take(draft.blades.len()).collect();
        draft.retain_blades(own);
    }
}

/// What is left, as cylinders and polygons: grown wood first, then petioles, then wood without history.
fn finish(draft: Draft) -> Tree {
    let grown = draft.segments.iter().filter_map(|segment| {
        let tip = segment.base + segment.direction * segment.length_m;
        // A segment of which nothing is left has no length and is no cylinder.
        Cylinder::new(segment.base.to_array(), tip.to_array(), segment.radius_m).ok()
    });
    let petioles = draft.blades.iter().filter_map(|Blade { petiole, .. }| *petiole);
    let mut tree = Tree {
        wood: grown.chain(petioles).chain(draft.wood.iter().copied()).collect(),
        facets: draft.facets.into_iter().chain(draft.fruits.iter().flat_map(fruit::facets)).collect(),
        leaves: draft.blades.into_iter().map(|blade| blade.leaf).collect(),
    };
    // Leaves are collected where the blades were, which take more than twice as much room.
    tree.leaves.shrink_to_fit();
    tree.wood.shrink_to_fit();
    tree
}

/// One tree of a hidden Markov tree at the origin, for unit tests.
#[cfg(test)]
pub(crate) fn grow_lone_tree(parameters: &TreeParameters, seed: u64) -> Tree {
    let orchard = OrchardParameters { trees: Some(1), ..OrchardParameters::default() };
    let generator = Some(super::kind::GeneratorKind::Hmt);
    let orchard = OrchardParameters { generator, tree: parameters.as_overrides(), ..orchard };
    let planting = Planting { row: 0, tree: 0, gap: false, is_young: false, base: [0.0; 3] };
    plant(&orchard, seed, &[planting], &[1], &|_, _| {}).unwrap().trees.remove(0)
}
