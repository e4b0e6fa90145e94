//! A grid over projected leaves.

/// The box around a projected leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shadow {
    low: (f64, f64),
    high: (f64, f64),
}

impl Shadow {
    const NOTHING: Self =
        Self { low: (f64::INFINITY, f64::INFINITY), high: (f64::NEG_INFINITY, f64::NEG_INFINITY) };

    /// The box around points; boxes around boxes by [`Shadow::joined`].
    pub(super) fn of(points: impl Iterator<Item = (f64, f64)>) -> Self {
        points.map(|point| Self { low: point, high: point }).fold(Self::NOTHING, Self::joined)
    }

    fn joined(self, other: Self) -> Self {
        Self {
            low: (self.low.0.min(other.low.0), self.low.1.min(other.low.1)),
            high: (self.high.0.max(other.high.0), self.high.1.max(other.high.1)),
        }
    }

    /// True where the box holds the point.
    pub(super) fn covers(&self, (u, v): (f64, f64)) -> bool {
        self.low.0 <= u && u <= self.high.0 && self.low.1 <= v && v <= self.high.1
    }
}

/// Square cells that list the shadows they touch.
#[derive(Debug)]
pub(super) struct Grid {
    origin: (f64, f64),
    cell_m: f64,
    columns: usize,
    rows: usize,
    /// Where each cell's list starts; one entry more than cells.
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Grid {
    /// Most cells a shadow, on average.
    const CELLS_PER_SHADOW: f64 = 4.0;

    /// Sorts the shadows into cells of about their own size.
    pub(super) fn over(shadows: &[Shadow]) -> Self {
        let whole = shadows.iter().copied().fold(Shadow::NOTHING, Shadow::joined);
        let (width, height) = (whole.high.0 - whole.low.0, whole.high.1 - whole.low.1);
        let size: f64 = shadows.iter().map(|s| (s.high.0 - s.low.0).max(s.high.1 - s.low.1)).sum();
        let count = shadows.len().max(1) as f64;
        // About the size of a shadow, but no more cells than a few a shadow however far they are scattered.
        let cell_m = (size / count).max((width * height / (Self::CELLS_PER_SHADOW * count)).sqrt()).max(1e-9);
        let cells =
            |length: f64| (length / cell_m).floor().clamp(0.0, Self::CELLS_PER_SHADOW * count) as usize + 1;
        let (columns, rows) = if shadows.is_empty() { (1, 1) } else { (cells(width), cells(height)) };
        let mut grid = Self {
            origin: whole.low,
            cell_m,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            members: vec![],
        };
        for shadow in shadows {
            for cell in grid.touched(shadow) {
                if let Some(count) = grid.starts.get_mut(cell) {
                    *count += 1;
                }
            }
        }
        let mut sum = 0;
        for start in &mut grid.starts {
            sum += std::mem::replace(start, sum);
        }
        grid.members = vec![0; sum as usize];
        let mut next = grid.starts.clone();
        for (number, shadow) in (0..).zip(shadows) {
            for cell in grid.touched(shadow) {
                let Some(slot) = next.get_mut(cell) else { continue };
                if let Some(member) = grid.members.get_mut(*slot as usize) {
                    *member = number;
                }
                *slot += 1;
            }
        }
        grid
    }

    fn column_row(&self, (u, v): (f64, f64)) -> (usize, usize) {
        let index = |value: f64, origin: f64, count: usize| {
            (((value - origin) / self.cell_m) as usize).min(count - 1)
        };
        (index(u, self.origin.0, self.columns), index(v, self.origin.1, self.rows))
    }

    fn touched(&self, shadow: &Shadow) -> impl Iterator<Item = usize> + use<> {
        let (low, high, columns) = (self.column_row(shadow.low), self.column_row(shadow.high), self.columns);
        (low.1..=high.1).flat_map(move |row| (low.0..=high.0).map(move |column| row * columns + column))
    }

    /// The shadows that touch the cell of a point (or of the nearest point of the grid).
    pub(super) fn cell(&self, at: (f64, f64)) -> &[u32] {
        let (column, row) = self.column_row(at);
        let bounds = self.starts.get(row * self.columns + column..).unwrap_or(&[]);
        match bounds {
            [from, to, ..] => self.members.get(*from as usize..*to as usize).unwrap_or(&[]),
            _ => &[],
        }
    }
}
