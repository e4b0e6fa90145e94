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

/// Rows scanned one way, over all seeds of a scene. The ways are held against each other, so their numbers are of the rows that every way tells; `None` where
/// there are too few of them.
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
    /// Rows that every way tells.
    pub rows: usize,
    /// Rows whose leaf area this way withholds.
    pub withheld: usize,
    /// Mean of estimate / truth − 1.
    pub bias: Option<f64>,
    /// Its standard deviation; from two rows on.
    pub sd: Option<f64>,
    /// Share of the intervals that hold the truth; `None` of a mean of two estimates, which has none.
    pub holds: Option<f64>,
    /// Half of an interval's width over the estimate.
    pub half_width: Option<f64>,
    /// Voxels that too few beams entered, of all.
    pub hidden: Option<f64>,
    /// Root mean square of a tree's estimate − truth, as measured, over the row's true mean.
    pub tree_rmse: Option<f64>,
    /// Standard deviation of a tree's error, both over their row's mean.
    pub tree_sd: Option<f64>,
}

/// A row, scanned one way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RowFound {
    ratio: f64,
    interval: Option<(bool, f64)>,
    hidden: f64,
    trees: Vec<Pair>,
}

/// A row by every way, in the order of [`WAYS`]; `None` where a way withholds its leaf area.
type RowByWay = [Option<RowFound>; 4];

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
                let rows: Vec<RowByWay> = asked
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
                let beams = if eye { "eye" } else { "rays" };
                found.extend(all_ways((&scene.name, model.name(), beams), &rows));
            }
        }
    }
    Ok(found)
}

/// The scene's row seen from the other alley, by a scanner on the tractor's other side: the drive goes the same way.
fn from_other_alley(mut scene: Scene) -> Scene {
    let Some(mount) = scene.rig.scanners.first_mut() else { return scene };
    let (side, alley) = match mount.row {
        RowSide::Right => (RowSide::Left, 1),
        RowSide::Left => (RowSide::Right, -1),
    };
    mount.row = side;
    scene.drive.alley = scene.drive.alley.map(|from| from + alley);
    scene
}

fn row(scene: Scene, model: AnyModel, notes: &mut RowNotes) -> Result<RowByWay, SidesError> {
    let near = Stage::grow(scene.clone(), &|_, _| {}).map_err(TrialError::from)?;
    let far = near.beside(from_other_alley(scene));
    let pipeline = |stage: &Stage| -> Result<_, TrialError> {
        let rig: Rig = rig_with(&stage.rig, 0, model.name());
        let ByHitsAndShares { by_hits, asked, .. } = ByHitsAndShares::of(&rig, false)?;
        Ok((by_hits.of_class(row_class(&stage.scene, &stage.truth(0))), asked))
    };
    let (other, asked) = pipeline(&far)?;
    let mut other = other.keeping_voxels();
    each_scan(&far, model, asked, &mut |scan| other.push(scan))?;
    let from_other = other.finish();
    let heading = Heading { start_m: far.rig.start_m, back: false };
    let (mut one, asked) = pipeline(&near)?;
    // A pass that tells nothing has nothing to join.
    let side = other.other_side(heading).ok().map(Arc::new);
    let mut both = side.map(|side| one.clone().joined_with(side)).transpose()?;
    each_scan(&near, model, asked, &mut |scan| {
        one.push(scan);
        both.iter_mut().for_each(|both| both.push(scan));
    })?;
    let truth_m2 = near.truth(0).leaf_area_m2;
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
    let estimates = [Some(one.finish()), Some(from_other), both.map(|mut both| both.finish())];
    estimates.iter().flatten().for_each(|estimate| notes.add(estimate));
    let [one, other, both] = estimates.each_ref().map(|estimate| found(estimate.as_ref()?));
    let mean = one.as_ref().zip(other.as_ref()).map(|(one, other)| mean_of(one, other));
    Ok([one, other, both, mean])
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

/// The scene, the scanner, and `rays` or `eye`.
type Place<'a> = (&'a str, &'static str, &'static str);

fn all_ways(place: Place<'_>, rows: &[RowByWay]) -> Vec<SidesFound> {
    let told: Vec<&RowByWay> = rows.iter().filter(|row| row.iter().all(Option::is_some)).collect();
    let ways = WAYS.iter().enumerate().map(|(way, from)| {
        let of_way: Vec<&RowFound> = told.iter().filter_map(|row| row.get(way)?.as_ref()).collect();
        let withheld = rows.iter().filter(|row| row.get(way).is_some_and(Option::is_none)).count();
        summed_up(place, *from, withheld, &of_way)
    });
    ways.collect()
}

fn summed_up(
    (scene, model, beams): Place<'_>,
    from: SeenFrom,
    withheld: usize,
    rows: &[&RowFound],
) -> SidesFound {
    let known = |values: &[f64], of: fn(&[f64]) -> f64| (!values.is_empty()).then(|| of(values));
    let ratios: Vec<f64> = rows.iter().map(|row| row.ratio - 1.0).collect();
    let intervals: Vec<(bool, f64)> = rows.iter().filter_map(|row| row.interval).collect();
    let of_intervals =
        |of: fn(&(bool, f64)) -> f64| known(&intervals.iter().map(of).collect::<Vec<_>>(), mean);
    let (mut errors, mut apart) = (Vec::new(), Vec::new());
    for row in rows {
        let of_row = |of: fn(&Pair) -> f64| mean(&row.trees.iter().map(of).collect::<Vec<_>>());
        let (found_m2, truth_m2) = (of_row(|tree| tree.unshrunk_m2), of_row(|tree| tree.truth_m2));
        for tree in &row.trees {
            errors.push((tree.unshrunk_m2 - tree.truth_m2) / truth_m2);
            apart.push(tree.unshrunk_m2 / found_m2 - tree.truth_m2 / truth_m2);
        }
    }
    SidesFound {
        scene: scene.to_owned(),
        model,
        beams,
        from,
        rows: rows.len(),
        withheld,
        bias: known(&ratios, mean),
        sd: moments(&ratios).1,
        holds: of_intervals(|interval| f64::from(u8::from(interval.0))),
        half_width: of_intervals(|interval| interval.1),
        hidden: known(&rows.iter().map(|row| row.hidden).collect::<Vec<_>>(), mean),
        tree_rmse: known(&errors, rms),
        tree_sd: known(&apart, rms),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(ratio: f64) -> Option<RowFound> {
        Some(RowFound { ratio, interval: Some((true, 0.2)), hidden: 0.1, trees: Vec::new() })
    }

    /// The other alley withholds two rows, both as one none: all numbers are of the two rows that every way tells.
    #[test]
    fn ways_are_compared_on_the_rows_that_all_tell_and_what_each_withholds_is_counted() {
        let rows = [
            [row(1.1), row(0.9), row(1.0), row(1.0)],
            [row(3.0), None, row(2.0), None],
            [row(1.3), row(1.1), row(1.2), row(1.2)],
            [row(3.0), None, row(2.0), None],
        ];
        let found = all_ways(("spindle", "lms111", "eye"), &rows);
        let counts: Vec<_> = found.iter().map(|way| (way.rows, way.withheld)).collect();
        assert_eq!(counts, [(2, 0), (2, 2), (2, 0), (2, 2)]);
        let bias: Vec<_> = found.iter().map(|way| (way.bias.expect("told") * 1e3).round()).collect();
        assert_eq!(bias, [200.0, 0.0, 100.0, 100.0]);
    }

    /// Whatever alley the drive is in: the other scanner looks at the same row, from its other side.
    #[test]
    fn the_other_alley_has_the_same_row() {
        for side in ["right", "left"] {
            for drive in ["", "[drive]\nalley = 1\n", "[drive]\nalley = 2\n"] {
                let text = format!("version = 2\n{drive}[[rig.scanner]]\nrow = \"{side}\"\n");
                let scene = rowscan_scenes::files::scene_from_text(&text, |_| {}).expect("a scene");
                let one = scene.row_seen(0).expect("a row");
                let other = from_other_alley(scene).row_seen(0).expect("a row");
                assert_eq!((one.row, !one.towards_x), (other.row, other.towards_x), "{side}, {drive}");
            }
        }
    }

    #[test]
    fn rows_that_are_all_withheld_are_a_line_without_numbers() {
        let found = all_ways(("spindle", "lms111", "eye"), &[[row(1.0), None, None, None]]);
        let told: Vec<_> =
            found.iter().map(|way| (way.rows, way.withheld, way.bias, way.sd, way.hidden)).collect();
        assert_eq!(told[0], (0, 0, None, None, None));
        assert_eq!(told[2], (0, 1, None, None, None));
        let one = all_ways(("spindle", "lms111", "eye"), &[[row(1.1), row(1.1), row(1.1), row(1.1)]]);
        assert_eq!(
            (one[0].rows, one[0].bias.is_some(), one[0].sd),
            (1, true, None),
            "a row alone has no scatter"
        );
    }
}
