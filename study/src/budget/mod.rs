//! What makes an estimator's error: each term by an experiment that replaces one thing and runs the estimator again.
//!
//! The experiments follow each other, each on what the one before left, so that the terms add up: their sum and the rest are the whole error.
//! A term is the difference that its replacement makes; another order would share the interactions out otherwise.

mod experiments;
mod report;
mod scattered;

use rowscan_protocol::model::Model;
use rowscan_scenes::Scene;
use serde::{Deserialize, Serialize};

pub use report::{BudgetReport, TermSummary, report};

use crate::archive::{Archive, Depends};
use crate::name::{self, Name};
use crate::trial::TrialError;

/// What is replaced, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Term {
    /// The calibration's factor by none; of `contact` only.
    Calibration,
    /// The scanner's optics by rays.
    Optics,
    /// The orchard by its leaves: no wood, posts, wires, fruit.
    Wood,
    /// The device's lines and beams by lines 10 mm and beams 0.1° apart, unquantised, the tractor standing in each.
    Sampling,
    /// The assumed projection function G by that of the leaves towards the scanner.
    Projection,
    /// The voxel edge by half of it.
    VoxelEdge,
    /// The leaves' places by random ones in their voxel of half the edge.
    Clumping,
    /// Each leaf by nine of a ninth of its area, at random in the same voxel.
    LeafSize,
}

impl Term {
    /// All of them, in the order of the experiments.
    pub const ALL: [Self; 8] = [
        Self::Calibration,
        Self::Optics,
        Self::Wood,
        Self::Sampling,
        Self::Projection,
        Self::VoxelEdge,
        Self::Clumping,
        Self::LeafSize,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Calibration => "calibration",
            Self::Optics => "optics",
            Self::Wood => "wood",
            Self::Sampling => "sampling",
            Self::Projection => "G",
            Self::VoxelEdge => "voxel edge",
            Self::Clumping => "clumping",
            Self::LeafSize => "leaf size",
        }
    }
}

/// The budget of one estimator on one row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// The estimator.
    #[serde(deserialize_with = "name::of_estimator")]
    pub estimator: Name,
    /// The row's seed.
    pub seed: u64,
    /// True one-sided leaf area, m².
    pub truth_m2: f64,
    /// The estimate as the device gives it, m².
    pub estimate_m2: f64,
    /// Estimate before less estimate after each replacement, m², in the order of [`Term::ALL`]; null once an experiment gave no estimate.
    pub terms_m2: [Option<f64>; 8],
    /// What the last estimate is off the truth, m²: hidden voxels and what fills them, and whatever no experiment replaces.
    pub rest_m2: f64,
}

impl Budget {
    /// From the estimates after no, one, two … replacements.
    fn of(estimator: &'static str, seed: u64, truth_m2: f64, chain: &[Option<f64>]) -> Option<Self> {
        let (first, after) = chain.split_first()?;
        let estimate_m2 = (*first)?;
        let mut last_m2 = estimate_m2;
        let mut known = true;
        let mut terms_m2 = [None; 8];
        for (term, next) in terms_m2.iter_mut().zip(after) {
            known &= next.is_some();
            if let Some(next_m2) = next.filter(|_| known) {
                *term = Some(last_m2 - next_m2);
                last_m2 = next_m2;
            }
        }
        Some(Self { estimator, seed, truth_m2, estimate_m2, terms_m2, rest_m2: last_m2 - truth_m2 })
    }
}

/// The budgets of every leaf area estimator on the rows of these seeds.
pub fn budgets(
    scene: &Scene,
    seeds: &[u64],
    model: &'static Model,
    archive: &Archive,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Budget>, TrialError> {
    use rayon::prelude::*;
    let rows: Result<Vec<Vec<Budget>>, TrialError> = seeds
        .par_iter()
        .map(|&seed| {
            let scene = Scene { seed, ..scene.clone() };
            let depends = || Some(Depends::on_pass(&scene, model.name));
            let budgets =
                archive.row("budget", depends, |notes| experiments::row(scene.clone(), model, notes));
            done();
            budgets
        })
        .collect();
    Ok(rows?.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_and_rest_are_the_whole_error_wherever_a_chain_breaks() {
        let chain = [Some(10.0), Some(9.0), Some(9.5), Some(7.0)];
        for broken in 1..=chain.len() {
            let mut chain = chain.to_vec();
            if let Some(gone) = chain.get_mut(broken) {
                *gone = None;
            }
            let budget = Budget::of("x", 1, 8.0, &chain).expect("an estimate");
            let sum: f64 = budget.terms_m2.iter().flatten().sum();
            assert!((sum + budget.rest_m2 - 2.0).abs() < 1e-12);
            assert_eq!(budget.terms_m2.iter().flatten().count(), broken.min(4) - 1);
        }
        assert_eq!(Budget::of("x", 1, 8.0, &[None, Some(1.0)]), None);
    }
}
