//! Whom leaves shade along one line. All are projected along it, and ask the middles within their outlines, eight at a time. In a dense
//! crown only those near its surface do: what lies deeper is hidden by leaves that cover whole cells.

use pulp::{Arch, Simd, WithSimd};

use super::blades::{Blades, Plane};
use super::cells::{Bounds, Grid};
use super::cover::Cover;
use super::open::{Face, Open};
use super::shadow::Shadow;

/// A leaf seen more edge-on than this hides nothing.
pub(super) const EDGE_ON: f64 = 1e-12;

/// Size of a cell over a leaf's reach. Leaves cover small cells sooner; large ones are fewer. Measured.
const CELL: f64 = 0.3;

/// Most cells a leaf.
const CELLS_PER_LEAF: usize = 4;

/// So many leaves must lie behind each other for a cover to be worth its time. Measured.
pub(super) const DENSE: f64 = 7.0;

/// Whether another leaf lies ahead of and behind each leaf's middle along a line.
pub(super) struct ShadePass<'a> {
    pub(super) plane: Plane,
    pub(super) blades: &'a Blades,
}

impl ShadePass<'_> {
    pub(super) fn run(self) -> Vec<[bool; 2]> {
        Arch::new().dispatch(self)
    }
}

impl WithSimd for ShadePass<'_> {
    type Output = Vec<[bool; 2]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<[bool; 2]> {
        let Self { plane, blades } = self;
        let points: Vec<(f64, f64)> = blades.blades.iter().map(|blade| plane.flat(blade.middle)).collect();
        let bounds = Bounds::of(points.iter().copied());
        let grid = Grid::new(bounds, CELL * blades.reach_m(), CELLS_PER_LEAF * points.len());
        let mut cover = Cover::none(&grid);
        // Leaves in all directions show half their area.
        let dense = 0.5 * blades.area_m2 > DENSE * bounds.area();
        if dense {
            cover.fill(simd, &grid, &plane, blades);
        }
        let mut met = vec![[false; 2]; points.len()];
        let mut open = Open::new(&grid, &cover, &plane, blades, &points, &mut met);
        let mut shadow = Shadow::new();
        for (number, blade) in blades.blades.iter().enumerate() {
            let facing = blade.normal.dot(plane.direction);
            if facing.abs() < EDGE_ON || dense && !open.faces(simd, &grid, &plane, blade) {
                continue;
            }
            shadow.cast(simd, &plane, blades, blade);
            let face = Face { number: number as f64, on: blade.on, normal: blade.normal, facing };
            for run in grid.runs(&shadow.bounds) {
                for first in open.sorted.places(run.cells).step_by(S::F64_LANES) {
                    face.ask(simd, &shadow, &mut open, first);
                }
            }
        }
        for (number, [ahead, behind]) in open.found() {
            if let Some(met) = met.get_mut(number) {
                *met = [met[0] || ahead, met[1] || behind];
            }
        }
        met
    }
}
