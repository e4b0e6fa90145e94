//! How a tree grows: a hidden Markov tree after Méndez et al. (2013).
//!
//! One season after the other every live axis draws a state ([`markov`]); a rule table ([`rules`]) says whether the draw
//! extends the axis or ends it in a fork. The growth units that result are laid out in space ([`skeleton`]), clothed with
//! leaves ([`foliage`]), thickened by the pipe model, thinned where too shaded ([`shade`]) and pruned to the envelope of the
//! orchard. [`TreeParameters::table`] lists every choice with its reason.

pub mod foliage;
pub mod markov;
mod parameters;
mod prune;
mod rotation;
pub mod rules;
pub mod shade;
pub mod skeleton;
mod wood;

pub use markov::{BranchingSource, MatrixSource, State};
pub use parameters::{TreeOverrides, TreeParameters};
pub use rules::RuleSource;
pub use skeleton::InternodeLaw;

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::organ::{Cylinder, Leaf, Tree};
use crate::parameters::ParameterError;
use crate::seed::{Stage, Stream};
use foliage::Blade;
use prune::Envelope;
use shade::ShadeScope;
use skeleton::{Grower, GrowthUnit};

/// One place of an orchard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Planting {
    /// Row, part of the tree's seed.
    pub(crate) row: u32,
    /// Number of the tree, part of its seed.
    pub(crate) tree: u32,
    /// Nothing grows here.
    pub(crate) gap: bool,
    /// Foot of the trunk, scene frame.
    pub(crate) base: [f64; 3],
}

/// A tree before shade and shears, in tree coordinates.
#[derive(Debug, Default)]
struct Draft {
    units: Vec<GrowthUnit>,
    radii: Vec<f64>,
    blades: Vec<Blade>,
}

/// Grows a tree for every place, in the scene frame, in the order of the places.
pub(crate) fn grow_all(
    parameters: &TreeParameters,
    seed: u64,
    plantings: &[Planting],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Tree>, GrowError> {
    let grower = Grower::new(parameters)?;
    let done = AtomicUsize::new(0);
    let drafts: Vec<Result<Draft, GrowError>> = plantings
        .par_iter()
        .map(|planting| {
            let draft = draft(&grower, parameters, seed, planting);
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, plantings.len());
            draft
        })
        .collect();
    // In order, so that of several errors it is always the same one that is told.
    let mut drafts: Vec<Draft> = drafts.into_iter().collect::<Result<_, _>>()?;
    if parameters.shady_scope == ShadeScope::Orchard {
        thin_together(&mut drafts, plantings, parameters);
    }
    let envelope = Envelope::of(parameters);
    let finished = drafts.par_iter().zip(plantings);
    Ok(finished
        .map(|(draft, planting)| finish(draft, envelope, parameters).translated(planting.base))
        .collect())
}

fn draft(
    grower: &Grower<'_>,
    parameters: &TreeParameters,
    seed: u64,
    planting: &Planting,
) -> Result<Draft, GrowError> {
    let &Planting { row, tree, gap, .. } = planting;
    if gap {
        return Ok(Draft::default());
    }
    let units = grower.grow(&mut Stream::new(seed, Stage::Growth, row, tree)).map_err(|exploded| {
        GrowError::Exploded { row, tree, season: exploded.season, limit: parameters.max_metamers }
    })?;
    let radii = wood::radii(&units, parameters);
    let mut blades = foliage::clothe(&units, parameters, &mut Stream::new(seed, Stage::Foliage, row, tree));
    if parameters.shady_scope == ShadeScope::Tree {
        let leaves: Vec<&Leaf> = blades.iter().map(|blade| &blade.leaf).collect();
        let keep = shade::survivors(&leaves, parameters);
        drop_shaded(&mut blades, &keep);
    }
    Ok(Draft { units, radii, blades })
}

/// Shade across trees: every leaf of the orchard where it stands, each once.
fn thin_together(drafts: &mut [Draft], plantings: &[Planting], parameters: &TreeParameters) {
    let placed: Vec<Leaf> = drafts
        .iter()
        .zip(plantings)
        .flat_map(|(draft, planting)| draft.blades.iter().map(|blade| blade.leaf.translated(planting.base)))
        .collect();
    let keep = shade::survivors(&placed.iter().collect::<Vec<_>>(), parameters);
    let mut rest = keep.as_slice();
    for draft in drafts {
        let (own, others) = rest.split_at(draft.blades.len().min(rest.len()));
        drop_shaded(&mut draft.blades, own);
        rest = others;
    }
}

fn drop_shaded(blades: &mut Vec<Blade>, keep: &[bool]) {
    let mut keep = keep.iter().copied();
    blades.retain(|_| keep.next().unwrap_or(true));
}

/// Pruned organs: growth units first, then petioles; each the cylinder or polygon that is left.
fn finish(draft: &Draft, envelope: Option<Envelope>, parameters: &TreeParameters) -> Tree {
    let kept_m = prune::kept_lengths(&draft.units, envelope, parameters);
    let blades = || {
        let kept = |blade: &&Blade| prune::keeps_leaf(blade, &kept_m, envelope, parameters.internode_m);
        draft.blades.iter().filter(kept)
    };
    let branches = draft.units.iter().zip(&draft.radii).zip(&kept_m).filter_map(|((unit, radius), kept)| {
        let tip = unit.base + unit.direction * *kept;
        // A unit of which nothing is left has no length and is no cylinder.
        Cylinder::new(unit.base.to_array(), tip.to_array(), *radius).ok()
    });
    Tree {
        leaves: blades().map(|blade| blade.leaf.clone()).collect(),
        wood: branches.chain(blades().filter_map(|blade| blade.petiole)).collect(),
    }
}

/// Why an orchard cannot be grown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GrowError {
    /// A parameter without meaning.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A tree outgrew its bound.
    #[error(
        "tree {tree} of row {row} exceeds {limit} metamers in season {season}; grow fewer orchard.tree.iterations or raise \
         orchard.tree.max_metamers"
    )]
    Exploded {
        /// Row of the tree.
        row: u32,
        /// Number of the tree.
        tree: u32,
        /// Season in which the bound was passed, from 1.
        season: u32,
        /// The bound.
        limit: u32,
    },
}

/// One tree at the origin, for unit tests.
#[cfg(test)]
pub(crate) fn grow_lone_tree(parameters: &TreeParameters, seed: u64) -> Tree {
    let planting = Planting { row: 0, tree: 0, gap: false, base: [0.0; 3] };
    grow_all(parameters, seed, &[planting], &|_, _| {}).unwrap().remove(0)
}
