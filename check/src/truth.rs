//! What is really there, as far as verdicts need it.

use rowscan_canopy::Estimate;
use rowscan_emulator::stage::Stage;

/// A way differs by what it differs more than this, relative: scans are delivered a little after they were made. Nothing jumps there, so a way near it gets the
/// same verdict each time.
const SAME_WAY: f64 = 0.02;

/// A net way that is less says nothing of what was passed, metres.
const LEAST_WAY_M: f64 = 0.5;

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
    /// driven, trees are cells of more or less row: then a tree's error counts with the estimate's way over the one driven, as it does in the row's leaf area.
    pub(crate) fn leaf_area_error(&self, estimate: &Estimate, way_m: Option<f64>) -> Option<f64> {
        let (mut found_m2, mut real_m2) = (0.0, 0.0);
        for found in estimate.trees.iter().filter(|tree| tree.complete) {
            // Behind the row's end stands none of its trees.
            let Some(real) = self.0.iter().find(|tree| tree.number == found.tree) else { continue };
            found_m2 += found.leaf.areas.best_m2().ok()?;
            real_m2 += real.leaf_area_m2?;
        }
        let times = match estimate.advance_m.zip(way_m) {
            // Back where it began it has passed what nobody can compare.
            Some((_, way_m)) if way_m.abs() < LEAST_WAY_M => return None,
            Some((by_estimate, way_m)) => (by_estimate / way_m).abs(),
            None => 1.0,
        };
        let apart = times - 1.0;
        let times = 1.0 + apart - apart.clamp(-SAME_WAY, SAME_WAY);
        (real_m2 > 0.0).then(|| (times * found_m2 - real_m2) / real_m2)
    }
}
