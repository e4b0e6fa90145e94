//! A row in cells of one length, of which each stretch of it is made.

use rowscan_scenes::Orchard;

/// Length of a cell, and height of an outline's, metres: the estimators'.
pub(crate) const CELL_M: f64 = 0.1;
/// Most cells of a row.
const MOST: f64 = 1e6;
/// How far beyond the row's end a scan of the row may be, metres.
const END_M: f64 = 0.1;
/// Smallest share of a cell that counts.
const LEAST_SHARE: f64 = 1e-6;

/// How many cells of which length a row has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellsAlong {
    /// None of a row that is too short or too long.
    pub(crate) count: usize,
    /// About [`CELL_M`]: a whole number of cells makes the row.
    pub(crate) cell_m: f64,
    /// A drive that turns finds the row's end.
    repeats: bool,
}

impl CellsAlong {
    /// Those of an orchard's rows.
    pub(crate) fn of(orchard: &Orchard) -> Self {
        let length_m = orchard.length_m();
        let count = (length_m / CELL_M).round();
        let count = if (1.0..=MOST).contains(&count) { count as usize } else { 0 };
        Self { count, cell_m: length_m / count as f64, repeats: orchard.period_m().is_finite() }
    }

    /// The row's length, metres.
    pub(crate) fn row_m(&self) -> f64 {
        self.cell_m * self.count as f64
    }

    /// The cells between two places, each with the share of it that lies there; of a row that repeats, as often as they ask for. `None` beyond a row that ends:
    /// nothing is known there.
    pub(crate) fn between(
        &self,
        from_m: f64,
        to_m: f64,
    ) -> Option<impl Iterator<Item = (usize, f64)> + use<>> {
        let Self { count, cell_m, repeats } = *self;
        let stands = repeats || (from_m > -END_M && to_m < self.row_m() + END_M);
        let first = (from_m / cell_m).floor() as i64;
        let last = (to_m / cell_m).ceil() as i64;
        let parts = (first..last).map(move |cell| {
            let (low_m, high_m) = (cell as f64 * cell_m, (cell + 1) as f64 * cell_m);
            let share = (high_m.min(to_m) - low_m.max(from_m)) / cell_m;
            (cell.rem_euclid(count as i64) as usize, share)
        });
        (stands && count > 0).then(|| parts.filter(|(_, share)| *share > LEAST_SHARE))
    }
}
