//! The tractor's place along the row, for faults that begin there.

use std::time::Duration;

use rowscan_faults::Row;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::Orchard;
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
        let row = orchard.standing().take(orchard.trees_per_row());
        let mut trunks_m: Vec<f64> = row.map(|(_, placement)| placement.base_m()[1]).collect();
        trunks_m.sort_unstable_by(f64::total_cmp);
        Self { tractor, trunks_m }
    }
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
