//! A row from one alley, from the other, and from both as one, against the truth: what the second pass is worth.

use std::sync::Arc;

use rayon::prelude::*;
use rowscan_canopy::regression::mean;
use rowscan_canopy::{Estimate, Heading, PipelineError, Withheld};
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{Rig, RowSide};
use rowscan_scenes::Scene;
use rowscan_scenes::optics::Stages;
use serde::{Deserialize, Serialize};

use crate::archive::{Archive, Depends};
use crate::class::row_class;
use crate::eye::placed;
use crate::moments;
use crate::notes::RowNotes;
use crate::pieces::{Pair, TruthBySlab, trees};
use crate::reading::rig_with;
use crate::rms;
use crate::trial::{ByHitsAndShares, TrialError, each_scan};

/// What is tried.
#[derive(Clone, Debug)]
pub struct SidesStudy {
    /// Scenes; by rays, and with all stages of the eye.
    pub scenes: Vec<Scene>,
    /// Rows of each.
    pub seeds: Vec<u64>,
    /// Scanners.
    pub models: Vec<AnyModel>,
    /// From the mirror to the row plane, metres.
    pub distance_m: f64,
}

/// Why a row could not be tried.
#[derive(Debug, thiserror::Error)]
pub enum SidesError {
    /// One of its passes.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// Passes that do not fit each other.
    #[error(transparent)]
    Sides(#[from] PipelineError),
    /// A pass that tells nothing.
    #[error("the pass from the other side tells nothing: {0}")]
    Withheld(#[from] Withheld),
}

/// From where a row was scanned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SeenFrom {
    /// Its first alley.
    One,
    /// The other one.
    Other,
    /// Both, as one.
    Both,
    /// Both, each by itself, and their mean.
    Mean,
}

/// All of them, in the order of tables.
const WAYS: [SeenFrom; 4] = [SeenFrom::One, SeenFrom::Other, SeenFrom::Both, SeenFrom::Mean];

impl SeenFrom {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::One => "one alley",
            Self::Other => "the other",
            Self::Both => "both as one",
            Self::Mean => "mean of both",
        }
    }
}

/// Rows scanned one way, over all seeds of a scene.
#[derive(Clone, Debug, Serialize)]
pub struct SidesFound {
    /// The scene.
    pub scene: String,
    /// The scanner.
    pub model: &'static str,
    /// `rays` or `eye`.
    pub beams: &'static str,
    /// From where.
    pub from: SeenFrom,
    /// Rows that were told.
    pub rows: usize,
    /// Mean of estimate / truth − 1.
    pub bias: f64,
    /// Its standard deviation.
    pub sd: f64,
    /// Share of the intervals that hold the truth; `None` of a mean of two estimates, which has none.
    pub holds: Option<f64>,
    /// Half of an interval's width over the estimate.
    pub half_width: Option<f64>,
    /// Voxels that too few beams entered, of all.
    pub hidden: f64,
    /// Root mean square of a tree's estimate − truth, as measured, over the row's true mean.
    pub tree_rmse: f64,
    /// Standard deviation of a tree's error, both over their row's mean.
    pub tree_sd: f64,
}

/// A row, scanned one way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RowFound {
    ratio: f64,
    interval: Option<(bool, f64)>,
    hidden: f64,
    trees: Vec<Pair>,
}

/// One from either alley.
const PASSES_A_ROW: usize = 2;

/// Passes that [`try_sides`] makes, by rays and by the eye.
pub fn passes(asked: &SidesStudy) -> usize {
    2 * PASSES_A_ROW * asked.scenes.len() * asked.seeds.len() * asked.models.len()
}

/// Tries everything; `done` hears of every pass that is through.
///
/// # Errors
/// The first row that could not be tried.
pub fn try_sides(
    asked: &SidesStudy,
    archive: &Archive,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<SidesFound>, SidesError> {
    let mut found = Vec::new();
    for scene in &asked.scenes {
        for model in &asked.models {
            for eye in [false, true] {
                let rows: Vec<Option<[RowFound; 4]>> = asked
                    .seeds
                    .par_iter()
                    .map(|seed| {
                        let mut scene = placed(scene, *model, asked.distance_m, *seed);
                        scene.optics.stages = if eye { Stages::device() } else { Stages::default() };
                        let depends = || Some(Depends::on_pass(&scene, model.name()));
                        let row = archive.row("sides", depends, |notes| row(scene.clone(), *model, notes));
                        (0..PASSES_A_ROW).for_each(|_| done());
                        row
                    })
                    .collect::<Result<_, _>>()?;
                let rows: Vec<[RowFound; 4]> = rows.into_iter().flatten().collect();
                let beams = if eye { "eye" } else { "rays" };
                let name = scene.name.clone();
                let ways = WAYS.iter().enumerate();
                found.extend(ways.filter_map(|(way, from)| {
                    let of_way: Vec<&RowFound> = rows.iter().filter_map(|row| row.get(way)).collect();
                    summed_up(&name, model.name(), beams, *from, &of_way)
                }));
            }
        }
    }
    Ok(found)
}

/// The scene's row seen from the other alley, by a scanner on the tractor's other side: the drive goes the same way.
fn from_other_alley(mut scene: Scene) -> Scene {
    if let Some(mount) = scene.rig.scanners.first_mut() {
        mount.row = match mount.row {
            RowSide::Right => RowSide::Left,
            RowSide::Left => RowSide::Right,
        };
    }
    scene
}

/// None where an estimate is withheld.
fn row(scene: Scene, model: AnyModel, notes: &mut RowNotes) -> Result<Option<[RowFound; 4]>, SidesError> {
    let near = Stage::grow(scene.clone(), &|_, _| {}).map_err(TrialError::from)?;
    let far = near.beside(from_other_alley(scene));
    let pipeline = |stage: &Stage| -> Result<_, TrialError> {
        let rig: Rig = rig_with(&stage.rig, 0, model.name());
        let ByHitsAndShares { by_hits, asked, .. } = ByHitsAndShares::of(&rig, false)?;
        Ok((by_hits.of_class(row_class(&stage.scene, &stage.orchard.truth())), asked))
    };
    let (other, asked) = pipeline(&far)?;
    let mut other = other.keeping_voxels();
    each_scan(&far, model, asked, &mut |scan| other.push(scan))?;
    let from_other = other.finish();
    let heading = Heading { start_m: far.rig.start_m, back: false };
    let side = Arc::new(other.other_side(heading)?);
    let (mut one, asked) = pipeline(&near)?;
    let mut both = one.clone().joined_with(side)?;
    each_scan(&near, model, asked, &mut |scan| {
        one.push(scan);
        both.push(scan);
    })?;
    let truth_m2 = near.orchard.truth().leaf_area_m2;
    let (slabs, spacing_m) = (TruthBySlab::of(&near), near.rig.tree_spacing_m.unwrap_or(1.0));
    let found = |estimate: &Estimate| {
        let leaf_m2 = estimate.leaf.areas.best_m2().ok()?;
        let contact = estimate.contact?;
        let hidden = contact.voxels_unvisited as f64;
        Some(RowFound {
            ratio: leaf_m2 / truth_m2,
            interval: estimate
                .leaf
                .interval_m2
                .map(|[low, high]| ((low..=high).contains(&truth_m2), (high - low) / 2.0 / leaf_m2)),
            hidden: hidden / (hidden + contact.voxels_visited as f64),
            trees: trees(estimate, &slabs, spacing_m),
        })
    };
    let estimates = [one.finish(), from_other, both.finish()];
    estimates.iter().for_each(|estimate| notes.add(estimate));
    let [Some(one), Some(other), Some(both)] = estimates.each_ref().map(found) else { return Ok(None) };
    let mean = mean_of(&one, &other);
    Ok(Some([one, other, both, mean]))
}

/// The mean of two estimates of a row.
fn mean_of(one: &RowFound, other: &RowFound) -> RowFound {
    let trees = one.trees.iter().zip(&other.trees);
    RowFound {
        ratio: (one.ratio + other.ratio) / 2.0,
        interval: None,
        hidden: (one.hidden + other.hidden) / 2.0,
        trees: trees
            .map(|(one, other)| Pair {
                unshrunk_m2: (one.unshrunk_m2 + other.unshrunk_m2) / 2.0,
                leaf_m2: (one.leaf_m2 + other.leaf_m2) / 2.0,
                ..*one
            })
            .collect(),
    }
}

fn summed_up(
    scene: &str,
    model: &'static str,
    beams: &'static str,
    from: SeenFrom,
    rows: &[&RowFound],
) -> Option<SidesFound> {
    let ratios: Vec<f64> = rows.iter().map(|row| row.ratio - 1.0).collect();
    let (bias, Some(sd)) = moments(&ratios) else { return None };
    let intervals: Vec<(bool, f64)> = rows.iter().filter_map(|row| row.interval).collect();
    let of_intervals = |of: fn(&(bool, f64)) -> f64| {
        (!intervals.is_empty()).then(|| mean(&intervals.iter().map(of).collect::<Vec<_>>()))
    };
    let (mut errors, mut apart) = (Vec::new(), Vec::new());
    for row in rows {
        let of_row = |of: fn(&Pair) -> f64| mean(&row.trees.iter().map(of).collect::<Vec<_>>());
        let (found_m2, truth_m2) = (of_row(|tree| tree.unshrunk_m2), of_row(|tree| tree.truth_m2));
        for tree in &row.trees {
            errors.push((tree.unshrunk_m2 - tree.truth_m2) / truth_m2);
            apart.push(tree.unshrunk_m2 / found_m2 - tree.truth_m2 / truth_m2);
        }
    }
    Some(SidesFound {
        scene: scene.to_owned(),
        model,
        beams,
        from,
        rows: rows.len(),
        bias,
        sd,
        holds: of_intervals(|interval| f64::from(u8::from(interval.0))),
        half_width: of_intervals(|interval| interval.1),
        hidden: mean(&rows.iter().map(|row| row.hidden).collect::<Vec<_>>()),
        tree_rmse: rms(&errors),
        tree_sd: rms(&apart),
    })
}
