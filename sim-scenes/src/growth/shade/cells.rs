//! Points of a plane, sorted into square cells.

use std::ops::Range;

/// The box around points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: (f64, f64),
    pub(super) high: (f64, f64),
}

impl Bounds {
    pub(super) fn of(points: impl Iterator<Item = (f64, f64)>) -> Self {
        let nothing =
            Self { low: (f64::INFINITY, f64::INFINITY), high: (f64::NEG_INFINITY, f64::NEG_INFINITY) };
        points.fold(nothing, |Self { low, high }, (u, v)| Self {
            low: (low.0.min(u), low.1.min(v)),
            high: (high.0.max(u), high.1.max(v)),
        })
    }
}

/// Which cells points lie in. Row by row, the cells of a row side by side: what a box holds of a row is one run.
#[derive(Debug)]
pub(super) struct Cells {
    origin: (f64, f64),
    per_m: f64,
    columns: usize,
    rows: usize,
    /// Where each cell's points start in the order; one entry more than cells.
    starts: Vec<usize>,
}

impl Cells {
    /// Most cells a point, on average.
    const CELLS_PER_POINT: f64 = 4.0;

    /// Sorts points into cells of about `size_m`. Gives the numbers of the points in their order.
    pub(super) fn new(points: &[(f64, f64)], size_m: f64) -> (Self, Vec<usize>) {
        let Bounds { low, high } = Bounds::of(points.iter().copied());
        let (width, height) = ((high.0 - low.0).max(0.0), (high.1 - low.1).max(0.0));
        let count = points.len().max(1) as f64;
        // No more cells than a few a point, however far they are scattered.
        let size_m = size_m.max((width * height / (Self::CELLS_PER_POINT * count)).sqrt()).max(1e-9);
        let cells =
            |length: f64| (length / size_m).floor().clamp(0.0, Self::CELLS_PER_POINT * count) as usize + 1;
        let mut sorted = Self {
            origin: low,
            per_m: 1.0 / size_m,
            columns: cells(width),
            rows: cells(height),
            starts: vec![],
        };
        let cell_of: Vec<usize> =
            points.iter().map(|(u, v)| sorted.row(*v) * sorted.columns + sorted.column(*u)).collect();
        let mut next = vec![0; sorted.columns * sorted.rows + 1];
        for cell in &cell_of {
            if let Some(count) = next.get_mut(*cell) {
                *count += 1;
            }
        }
        let mut sum = 0;
        for start in &mut next {
            sum += std::mem::replace(start, sum);
        }
        sorted.starts.clone_from(&next);
        let mut order = vec![0; points.len()];
        for (number, cell) in cell_of.into_iter().enumerate() {
            let Some(place) = next.get_mut(cell) else { continue };
            if let Some(entry) = order.get_mut(*place) {
                *entry = number;
            }
            *place += 1;
        }
        (sorted, order)
    }

    fn column(&self, u: f64) -> usize {
        (((u - self.origin.0) * self.per_m) as usize).min(self.columns - 1)
    }

    fn row(&self, v: f64) -> usize {
        (((v - self.origin.1) * self.per_m) as usize).min(self.rows - 1)
    }

    /// Runs of the order that hold all points within the bounds, and others near them.
    pub(super) fn runs(&self, bounds: Bounds) -> impl Iterator<Item = Range<usize>> {
        let (first, last) = (self.column(bounds.low.0), self.column(bounds.high.0));
        (self.row(bounds.low.1)..=self.row(bounds.high.1)).map(move |row| {
            let start = |column: usize| self.starts.get(row * self.columns + column).copied().unwrap_or(0);
            start(first)..start(last + 1)
        })
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
            let (cells, order) = Cells::new(&points, cell);
            let bounds = Bounds { low: a, high: (a.0 + size.0, a.1 + size.1) };
            let mut found: Vec<usize> = cells.runs(bounds).flat_map(|run| order[run].to_vec()).collect();
            found.sort_unstable();
            prop_assert!(found.windows(2).all(|pair| pair[0] < pair[1]));
            let holds = |(u, v): (f64, f64)| {
                bounds.low.0 <= u && u <= bounds.high.0 && bounds.low.1 <= v && v <= bounds.high.1
            };
            let within = (0..points.len()).filter(|number| holds(points[*number]));
            prop_assert!(within.into_iter().all(|number| found.contains(&number)));
        }
    }
}
