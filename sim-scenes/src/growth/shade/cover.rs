//! Which cells of a line's plane leaves cover whole, and how deep they lie there.
//!
//! In a dense crown a few leaves near its surface cover a cell, and hide all middles behind them without being asked for each.

use pulp::Simd;

use super::blades::{Blades, Depth, HAIR_M, Plane};
use super::cells::{Bounds, Grid, Run};
use super::shadow::Shadow;
use crate::lanes::{Lanes, padded};

/// Leaves seen more edge-on than this cover hardly a cell.
const TOO_EDGE_ON: f64 = 0.3;

/// What lies beyond `front` lies behind a leaf that covers the cell, and what lies this side of `back` before one.
pub(super) struct Cover {
    pub(super) front: Vec<f64>,
    pub(super) back: Vec<f64>,
}

impl Cover {
    /// Cells that nothing covers.
    pub(super) fn none(grid: &Grid) -> Self {
        let all = |depth: f64| padded(vec![depth; grid.len()]);
        Self { front: all(f64::INFINITY), back: all(f64::NEG_INFINITY) }
    }

    #[inline(always)]
    pub(super) fn fill<S: Simd>(&mut self, simd: S, grid: &Grid, plane: &Plane, blades: &Blades) {
        let mut shadow = Shadow::new();
        for blade in &blades.blades {
            let facing = blade.normal.dot(plane.direction);
            if facing.abs() < TOO_EDGE_ON {
                continue;
            }
            let depth = blade.depth(plane.direction);
            // Deep in the crown one look shows that little is to be gained.
            let cell = grid.cell(plane.flat(blade.middle));
            let gains = |(front, back): (&f64, &f64)| depth.far < *front || *back < depth.near;
            if self.front.get(cell).zip(self.back.get(cell)).is_some_and(gains) {
                shadow.cast(simd, plane, blades, blade);
                self.add(simd, grid, &shadow, depth, facing < 0.0);
            }
        }
    }

    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, grid: &Grid, shadow: &Shadow, depth: Depth, turned: bool) {
        let (near, far) = (Lanes::splat(simd, depth.near), Lanes::splat(simd, depth.far));
        let (size, Bounds { low, high }) = (grid.size_m(), shadow.bounds);
        // Its corners lie in the outermost cells that fit whole.
        let inner = Bounds { low: (low.0 + size, low.1 + size), high: (high.0 - size, high.1 - size) };
        for Run { row, column, cells } in grid.runs(&inner) {
            let (first_u, v) = grid.middle(row, column);
            let (start, end) = (cells.start, near.of(cells.end as f64));
            for at in cells.step_by(S::F64_LANES) {
                let u = near.of(first_u) + Lanes::count_from(simd, at - start) * near.of(size);
                // A register may reach into the next row.
                let own = Lanes::count_from(simd, at).lt(end);
                let clear = own.and(shadow.clear(u, v, 0.5 * size + HAIR_M, turned));
                if clear.is_empty() {
                    continue;
                }
                let covered = clear.and(shadow.holds(u, near.of(v)));
                if let (Some(front), Some(back)) =
                    (Lanes::read(simd, &self.front, at), Lanes::read(simd, &self.back, at))
                {
                    covered.select(front.min(far), front).write(&mut self.front, at);
                    covered.select(back.max(near), back).write(&mut self.back, at);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use pulp::{Arch, WithSimd};

    use super::*;
    use crate::organ::Leaf;

    struct Fill<'a>(&'a Grid, &'a Plane, &'a Blades);

    impl WithSimd for Fill<'_> {
        type Output = Cover;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Cover {
            let Self(grid, plane, blades) = self;
            let mut cover = Cover::none(grid);
            cover.fill(simd, grid, plane, blades);
            cover
        }
    }

    #[test]
    fn a_leaf_covers_the_cells_that_lie_whole_within_it_and_no_others() {
        let plane = Plane::square_to(DVec3::Z);
        let grid = Grid::new(Bounds { low: (0.0, 0.0), high: (0.95, 0.95) }, 0.1, 1000);
        // The leaf stands out to the right, where the register goes on with the next row.
        let corners = [(0.75, 0.25), (3.0, 0.25), (3.0, 2.0), (0.75, 2.0)];
        let vertex = |(u, v): (f64, f64)| (u * plane.u + v * plane.v + 5.0 * plane.direction).to_array();
        for corners in [corners, [corners[3], corners[2], corners[1], corners[0]]] {
            let leaf = Leaf::new(corners.map(vertex)).unwrap();
            let cover = Arch::new().dispatch(Fill(&grid, &plane, &Blades::new(&[&leaf])));
            for (row, column) in (0..10).flat_map(|row| (0..10).map(move |column| (row, column))) {
                let cell = grid.cell(grid.middle(row, column));
                let covered = row >= 3 && column >= 8;
                assert_eq!(cover.front[cell].is_finite(), covered, "{row} {column}");
                assert_eq!(cover.back[cell].is_finite(), covered, "{row} {column}");
            }
        }
    }
}
