//! The footprints of a line's beams: planes and rays cast once, shared by all beams that they lie in.

use pulp::{Arch, Simd, WithSimd};
use rowscan_protocol::scan::Pose;

use super::parts::{Column, Parts};
use super::rays::{Rays, Weigh};
use super::spot::SpotGrid;
use crate::caster::{BeamFan, Caster, Return, Scratch};
use crate::lanes::{Lanes, Row, WIDTH};

/// A place so far across the fan's plane.
fn beside(from: Pose, fan: &BeamFan, across_m: f64) -> Pose {
    let [x, y, z] = fan.axes().map_or([0.0, 1.0, 0.0], |axes| axes.ahead);
    Pose { x_m: from.x_m + x * across_m, y_m: from.y_m + y * across_m, z_m: from.z_m + z * across_m }
}

/// The casts of one line, and room for the next.
#[derive(Clone, Debug)]
pub(super) struct Footprint {
    grid: SpotGrid,
    fan: BeamFan,
    margin: usize,
    beams: usize,
    scratch: Scratch,
    /// Plane by plane.
    returns: Vec<Return>,
    rays: Rays,
}

/// Gathers what the parts of eight beams met.
struct Gather<'a> {
    footprint: &'a Footprint,
    /// Number of the eight.
    row: usize,
    parts: &'a mut Parts,
}

impl WithSimd for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { footprint: Footprint { grid, fan, margin, rays, .. }, row, parts } = self;
        let zero = Lanes::splat(simd, 0.0);
        let nothing = zero.of(f64::INFINITY);
        let mut nearest_m = Row::splat(f64::INFINITY);
        let axis = margin + row * WIDTH * grid.fold;
        for plane in 0..grid.planes(0).len() {
            let reach = rays.reach(plane, row);
            let mut place = rays.place(axis - reach);
            for number in 0..=2 * reach {
                let at = rays.at(plane, place);
                place = rays.next(place);
                let (mut column, mut met) = (Column::NOTHING, false);
                for part in 0..Row::parts::<S>() {
                    let Some(swept) = rays.swept(simd, at + part * S::F64_LANES) else { break };
                    let share = swept.weight(number.abs_diff(reach), grid.step_rad);
                    met |= !zero.lt(share).is_empty();
                    column.share.store(part, share);
                }
                if !met {
                    continue;
                }
                for part in 0..Row::parts::<S>() {
                    let Some([range_m, gain]) = rays.met(simd, at + part * S::F64_LANES) else { break };
                    let share = column.share.load(simd, part);
                    let touched = zero.lt(share);
                    let range_m = touched.select(range_m, nothing);
                    column.range_m.store(part, range_m);
                    column.power.store(part, touched.select(share * gain, zero));
                    nearest_m.store(part, nearest_m.load(simd, part).min(range_m));
                }
                parts.push(column, plane * fan.len() + axis + number - reach);
            }
        }
        parts.set_nearest_m(nearest_m);
    }
}

impl Footprint {
    /// For the beams of `fan`, sampled as `grid` says.
    pub(super) fn new(grid: SpotGrid, fan: &BeamFan) -> Self {
        let (margin, beams) = (grid.margin(), fan.len());
        let fan = fan.refined(grid.fold, margin);
        let planes = grid.planes(0).len();
        Self {
            rays: Rays::new(planes, fan.len(), &grid, margin, beams),
            returns: vec![Return::MISS; planes * fan.len()],
            fan,
            margin,
            beams,
            grid,
            scratch: Scratch::default(),
        }
    }

    /// The same beams in other directions.
    pub(super) fn tilt(&mut self, fan: &BeamFan) {
        self.fan = fan.refined(self.grid.fold, self.margin);
    }

    /// The same beams in a plane that leans so.
    pub(super) fn lean(&mut self, fan: &BeamFan) {
        self.fan.lean(fan.axes().copied());
    }

    /// Casts a line whose first beam starts at `origin`, with the plane grid at place `phase`. `surface` is what comes back of a ray at 1 m: its
    /// power relative to a white wall.
    pub(super) fn cast(
        &mut self,
        caster: &Caster,
        origin: Pose,
        advance_m: f64,
        phase: usize,
        surface: impl Fn(&Return) -> f64,
    ) {
        let Self { grid, fan, margin, scratch, returns, rays, .. } = self;
        let advance_m = advance_m / grid.fold as f64;
        fan.advance(advance_m);
        let first_m = origin.y_m - *margin as f64 * advance_m;
        let lines = returns.chunks_exact_mut(fan.len().max(1));
        for (number, (plane, returns)) in grid.planes(phase).iter().zip(lines).enumerate() {
            let from = beside(Pose { y_m: first_m, ..origin }, fan, plane.y_m);
            caster.cast(from, fan, scratch, returns);
            rays.fill(number, returns, &surface);
            Arch::new().dispatch(Weigh { rays, grid, number, plane, margin: *margin });
        }
    }

    /// What the parts of eight beams met, plane by plane: of row `row` of beams.
    pub(super) fn gather(&self, row: usize, parts: &mut Parts) {
        parts.reset(self.grid.fold);
        Arch::new().dispatch(Gather { footprint: self, row, parts });
    }

    /// What a ray met.
    pub(super) fn met(&self, ray: u32) -> Return {
        self.returns.get(ray as usize).copied().unwrap_or(Return::MISS)
    }

    /// Planes, and rays cast in each.
    pub(super) fn rays(&self) -> [usize; 2] {
        [self.grid.planes(0).len(), self.fan.len()]
    }

    /// Number of beams.
    pub(super) fn beams(&self) -> usize {
        self.beams
    }
}
