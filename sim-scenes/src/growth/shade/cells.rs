//! Square cells of a plane, and numbers sorted by them.

use std::ops::Range;

/// A box in a plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: (f64, f64),
    pub(super) high: (f64, f64),
}

impl Bounds {
    /// The box around points.
    pub(super) fn of(points: impl Iterator<Item = (f64, f64)>) -> Self {
        let nothing =
            Self { low: (f64::INFINITY, f64::INFINITY), high: (f64::NEG_INFINITY, f64::NEG_INFINITY) };
        points.fold(nothing, |Self { low, high }, (u, v)| Self {
            low: (low.0.min(u), low.1.min(v)),
            high: (high.0.max(u), high.1.max(v)),
        })
    }

    pub(super) fn area(&self) -> f64 {
        (self.high.0 - self.low.0) * (self.high.1 - self.low.1)
    }
}

/// Cells over a box, row by row; what lies outside counts to the nearest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    low: (f64, f64),
    size_m: f64,
    per_m: f64,
    columns: usize,
    rows: usize,
}

/// Cells side by side.
pub(super) struct Run {
    pub(super) row: usize,
    /// Column of the first.
    pub(super) column: usize,
    /// Their numbers.
    pub(super) cells: Range<usize>,
}

impl Grid {
    /// Cells of `size_m`; larger ones where there would be more than about `most`.
    pub(super) fn new(over: Bounds, size_m: f64, most: usize) -> Self {
        let Bounds { low, high } = over;
        let most = most.max(1) as f64;
        let size_m = size_m.max((over.area().max(0.0) / most).sqrt()).max(1e-9);
        let cells = |length: f64| (length / size_m).floor().clamp(0.0, most) as usize + 1;
        let (columns, rows) = (cells(high.0 - low.0), cells(high.1 - low.1));
        Self { low, size_m, per_m: 1.0 / size_m, columns, rows }
    }

    pub(super) fn len(&self) -> usize {
        self.columns * self.rows
    }

    pub(super) fn size_m(&self) -> f64 {
        self.size_m
    }

    pub(super) fn middle(&self, row: usize, column: usize) -> (f64, f64) {
        let at = |low: f64, cells: usize| low + (cells as f64 + 0.5) * self.size_m;
        (at(self.low.0, column), at(self.low.1, row))
    }

    fn column(&self, u: f64) -> usize {
        (((u - self.low.0) * self.per_m) as usize).min(self.columns - 1)
    }

    fn row(&self, v: f64) -> usize {
        (((v - self.low.1) * self.per_m) as usize).min(self.rows - 1)
    }

    /// The number of a point's cell.
    pub(super) fn cell(&self, (u, v): (f64, f64)) -> usize {
        self.row(v) * self.columns + self.column(u)
    }

    /// The cells of all points within the bounds.
    pub(super) fn runs(&self, bounds: &Bounds) -> impl Iterator<Item = Run> {
        let (column, last) = (self.column(bounds.low.0), self.column(bounds.high.0));
        let columns = self.columns;
        (self.row(bounds.low.1)..=self.row(bounds.high.1)).map(move |row| {
            let first = row * columns;
            Run { row, column, cells: first + column..first + last + 1 }
        })
    }
}

/// Numbers in the order of their cells: those of cells side by side are one run.
#[derive(Debug)]
pub(super) struct Sorted {
    /// Where each cell starts in the order; one entry more than cells.
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Sorted {
    /// Sorts pairs of number and cell.
    pub(super) fn new(numbers: &[(u32, u32)], cells: usize) -> Self {
        let mut next = vec![0; cells + 1];
        for (_, cell) in numbers {
            if let Some(count) = next.get_mut(*cell as usize) {
                *count += 1;
            }
        }
        let mut sum = 0;
        for start in &mut next {
            sum += std::mem::replace(start, sum);
        }
        let starts = next.clone();
        let mut order = vec![0; numbers.len()];
        for (number, cell) in numbers {
            let Some(place) = next.get_mut(*cell as usize) else { continue };
            if let Some(entry) = order.get_mut(*place as usize) {
                *entry = *number;
            }
            *place += 1;
        }
        Self { starts, order }
    }

    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    /// Where the numbers of these cells stand in the order.
    pub(super) fn places(&self, cells: Range<usize>) -> Range<usize> {
        let start = |cell: usize| self.starts.get(cell).copied().unwrap_or(0) as usize;
        start(cells.start)..start(cells.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_points_of_a_box_are_all_among_its_runs(
            points in prop::collection::vec((-3.0..3.0f64, -1.0..9.0f64), 0..60),
            a in (-4.0..4.0f64, -2.0..10.0f64), size in (0.0..5.0f64, 0.0..5.0f64), cell in 0.01..3.0f64,
        ) {
            let grid = Grid::new(Bounds::of(points.iter().copied()), cell, 4 * points.len());
            let cells: Vec<(u32, u32)> = (0..).zip(points.iter().map(|at| grid.cell(*at) as u32)).collect();
            let sorted = Sorted::new(&cells, grid.len());
            let bounds = Bounds { low: a, high: (a.0 + size.0, a.1 + size.1) };
            let mut found: Vec<u32> =
                grid.runs(&bounds).flat_map(|run| sorted.order()[sorted.places(run.cells)].to_vec()).collect();
            found.sort_unstable();
            prop_assert!(found.windows(2).all(|pair| pair[0] < pair[1]));
            let holds = |(u, v): (f64, f64)| {
                bounds.low.0 <= u && u <= bounds.high.0 && bounds.low.1 <= v && v <= bounds.high.1
            };
            let within = (0..).zip(&points).filter(|(_, at)| holds(**at));
            prop_assert!(within.into_iter().all(|(number, _)| found.contains(&number)));
        }
    }
}
