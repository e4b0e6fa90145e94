//! The tractor's place along the row, for faults that begin there.

use std::time::Duration;

use rowscan_faults::Row;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::{Orchard, Tree};
use rowscan_vehicle::Tractor;

/// A tractor beside the first row of an orchard.
#[derive(Debug)]
pub struct StageRow {
    tractor: Tractor,
    /// Where the first row's trunks stand along it, in their order, metres.
    trunks_m: Vec<f64>,
}

impl StageRow {
    /// `tractor` beside `orchard`.
    pub fn new(tractor: Tractor, orchard: &Orchard) -> Self {
        let row = orchard.standing().take(orchard.trees_per_row()).zip(0_u32..);
        let mut trunks_m: Vec<f64> = row
            .filter_map(|((tree, placement), place)| {
                if !placement.is_here() {
                    return Some(placement.base_m()[1]);
                }
                // It stands where it was made: its place is that of its own foot, or of its cell where nothing grows.
                let foot = orchard.distinct_trees().get(tree).and_then(foot_m);
                foot.or_else(|| Some((f64::from(place) + 0.5) * orchard.tree_spacing_m()?))
            })
            .collect();
        trunks_m.sort_unstable_by(f64::total_cmp);
        Self { tractor, trunks_m }
    }
}

/// Where the lowest wood of a tree begins along the row, metres.
fn foot_m(tree: &Tree) -> Option<f64> {
    let lowest = tree.wood.iter().min_by(|a, b| f64::total_cmp(&a.base()[2], &b.base()[2]))?;
    Some(lowest.base()[1])
}

impl Row for StageRow {
    fn row_m(&self, at: Duration) -> Option<f64> {
        let at = SimTime::ZERO + at;
        let began = self.tractor.began()?;
        (at >= began).then(|| self.tractor.motion(at).place.y_m)
    }

    fn drives_to_row_m(&self, row_m: f64) -> Option<Duration> {
        self.tractor.drives_to(row_m)
    }

    fn drives_to_tree(&self, tree: u32) -> Option<Duration> {
        let number = usize::try_from(tree).ok()?.checked_sub(1)?;
        self.tractor.drives_to(*self.trunks_m.get(number)?)
    }

    fn tree(&self, at: Duration) -> Option<u32> {
        let here = self.row_m(at)?;
        let reached = self.trunks_m.iter().take_while(|trunk| **trunk <= here).count();
        u32::try_from(reached).ok()
    }
}

#[cfg(test)]
mod tests {
    use rowscan_scenes::files::{load_scene, scene_from_text};
    use rowscan_vehicle::trajectory::Trajectory;

    use super::*;

    fn row(scene: &rowscan_scenes::Scene) -> (StageRow, f64) {
        let orchard = Orchard::grow(&scene.orchard, 7, &|_, _| {}).unwrap();
        let tractor = Tractor::new(Trajectory::straight(0.0, 1.0));
        tractor.begin(SimTime::ZERO);
        (StageRow::new(tractor, &orchard), orchard.tree_spacing_m().unwrap())
    }

    #[test]
    fn a_tree_is_reached_at_its_own_trunk() {
        let copies = scene_from_text("version = 1\n[orchard]\ntrees = 12\ndistinct_trees = 3\n", |_| {});
        for scene in [load_scene("spindle", |_| {}).unwrap(), copies.unwrap()] {
            let (row, spacing_m) = row(&scene);
            for tree in 1..=4_u32 {
                let reached_s = row.drives_to_tree(tree).unwrap().as_secs_f64();
                let middle_m = (f64::from(tree) - 0.5) * spacing_m;
                assert!((reached_s - middle_m).abs() < 0.3 * spacing_m, "tree {tree} at {reached_s} m");
                let (before, after) = ((reached_s - 0.01), (reached_s + 0.01));
                assert_eq!(row.tree(Duration::from_secs_f64(before)), Some(tree - 1));
                assert_eq!(row.tree(Duration::from_secs_f64(after)), Some(tree));
            }
        }
    }
}
