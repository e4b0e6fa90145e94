//! What is really there, as far as verdicts need it.

use rowscan_canopy::{AdvanceSource, Estimate};
use rowscan_emulator::stage::Stage;

/// Relative difference of two ways that is not counted, because scans are delivered a little after they were made. It is taken off larger differences, too, so
/// that the result has no step here.
const SAME_WAY: f64 = 0.02;

/// Ways that are less apart are the same, metres.
const LEAST_APART_M: f64 = 0.1;

/// A net way that is less says nothing of what was passed, metres.
const LEAST_WAY_M: f64 = 0.5;

/// Where a scan was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Passed {
    /// Along the row, by the estimate, metres.
    pub(crate) y_m: f64,
    /// Driven by then, less what was driven in reverse, metres.
    pub(crate) way_m: f64,
}

/// How much of the row some scans reach over, by the estimate and in truth, metres: what is driven to and fro counts once.
struct Reach {
    estimate_m: f64,
    way_m: f64,
}

impl Reach {
    fn of<'a>(passed: impl Iterator<Item = &'a Passed> + Clone) -> Self {
        let reach = |of: fn(&Passed) -> f64| {
            let ends = passed
                .clone()
                .map(of)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
            (ends.1 - ends.0).max(0.0)
        };
        Self { estimate_m: reach(|at| at.y_m), way_m: reach(|at| at.way_m) }
    }

    /// Of all scans where the estimate went by other places than those that are known, as after it fell back from the encoder to another advance; `None` where they
    /// are its own.
    fn fallen_back(estimate: &Estimate, passed: &[Passed]) -> Option<Self> {
        let (begun, ended) = passed.first().zip(passed.last())?;
        let own_m = estimate.advance_m.unwrap_or_default();
        let is_its_own = (ended.y_m - begun.y_m - own_m).abs() <= SAME_WAY * own_m.abs();
        (!is_its_own).then(|| Self { estimate_m: own_m.abs(), way_m: (ended.way_m - begun.way_m).abs() })
    }
}

/// Where an estimate went by the rig's constant speed and the tractor did not: the way by the one and by the other, metres. Its areas belong
/// to a way that was not driven.
pub(crate) fn other_way(estimate: &Estimate, passed: &[Passed]) -> Option<(f64, f64)> {
    if estimate.advance_source != Some(AdvanceSource::Constant) {
        return None;
    }
    let reach = Reach::fallen_back(estimate, passed).unwrap_or_else(|| Reach::of(passed.iter()));
    let Reach { estimate_m, way_m } = reach;
    let apart_m = (estimate_m - way_m).abs();
    (apart_m > LEAST_APART_M && apart_m > SAME_WAY * way_m).then_some((estimate_m, way_m))
}

/// The trees of a row.
#[derive(Clone, Debug)]
pub(crate) struct Trees(Vec<Tree>);

#[derive(Clone, Copy, Debug)]
struct Tree {
    number: u32,
    y_m: Option<f64>,
    /// Leaf area between the tree's borders, whoever's leaves they are: what an estimate by tree can know.
    leaf_area_m2: Option<f64>,
}

impl Trees {
    /// Of the row that the rig's scanner of this number sees.
    pub(crate) fn of(stage: &Stage, scanner: usize) -> Self {
        let trees = stage.truth(scanner).trees;
        let tree = |tree: &rowscan_scenes::TreeTruth| Tree {
            number: tree.tree,
            y_m: tree.y_m,
            leaf_area_m2: tree.cell_leaf_area_m2,
        };
        Self(trees.iter().map(tree).collect())
    }

    /// The tree nearest to `row_m` along the row.
    pub(crate) fn beside(&self, row_m: f64) -> Option<u32> {
        let away = |tree: &&Tree| tree.y_m.map_or(f64::INFINITY, |y_m| (y_m - row_m).abs());
        let nearest = self.0.iter().min_by(|a, b| away(a).total_cmp(&away(b)))?;
        nearest.y_m.map(|_| nearest.number)
    }

    /// (estimate − truth) / truth of the leaf area, over the trees scanned from end to end; none without any. By an encoder that counts more or less than was
    /// driven, trees are cells of more or less row: then a tree's error counts with the estimate's way over the one driven past these trees, as it does in the
    /// row's leaf area. `passed` is where the estimate had each scan along the row, and the tractor's way there, metres.
    pub(crate) fn leaf_area_error(&self, estimate: &Estimate, passed: &[Passed]) -> Option<f64> {
        let (mut found_m2, mut real_m2) = (0.0, 0.0);
        let (mut from_m, mut to_m) = (f64::INFINITY, f64::NEG_INFINITY);
        for found in estimate.trees.iter().filter(|tree| tree.complete) {
            // Behind the row's end stands none of its trees.
            let Some(real) = self.0.iter().find(|tree| tree.number == found.tree) else { continue };
            found_m2 += found.leaf.areas.best_m2().ok()?;
            real_m2 += real.leaf_area_m2?;
            let half_m = 0.5 * found.scanned_m;
            (from_m, to_m) = (from_m.min(found.y_m - half_m), to_m.max(found.y_m + half_m));
        }
        let beside = passed.iter().filter(|at| (from_m..=to_m).contains(&at.y_m));
        let Reach { estimate_m, way_m } =
            Reach::fallen_back(estimate, passed).unwrap_or_else(|| Reach::of(beside));
        // A tractor that hardly moved has passed too little to compare.
        let times = (way_m >= LEAST_WAY_M).then(|| estimate_m / way_m)?;
        let apart = times - 1.0;
        let times = 1.0 + apart - apart.clamp(-SAME_WAY, SAME_WAY);
        (real_m2 > 0.0).then(|| (times * found_m2 - real_m2) / real_m2)
    }
}
