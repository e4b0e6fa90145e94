//! The footprints of a line's beams: planes and rays cast once, shared by all beams that they lie in.

use rowscan_protocol::scan::Pose;

use super::spot::{Extent, SpotGrid};
use super::touch::Touch;
use crate::caster::{BeamFan, Caster, Return, Scratch};

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
    rays: Vec<Ray>,
    planes: usize,
    /// Rays to each side that the widest spot of the line reaches.
    reach: usize,
}

/// A ray that met something, ready for the beams that it lies in.
#[derive(Clone, Copy, Debug, Default)]
struct Ray {
    range_m: f64,
    /// Power that comes back of a share of 1.
    gain: f64,
    extent: Extent,
}

impl Footprint {
    /// For the beams of `fan`, sampled as `grid` says.
    pub(super) fn new(grid: SpotGrid, fan: &BeamFan) -> Self {
        let margin = grid.margin();
        Self {
            fan: fan.refined(grid.fold, margin),
            margin,
            beams: fan.len(),
            grid,
            scratch: Scratch::default(),
            returns: Vec::new(),
            rays: Vec::new(),
            planes: 0,
            reach: 0,
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

    /// Casts a line whose first beam starts at `origin`, with the plane grid at place `phase`. `gain` is what comes back of a ray: its
    /// power relative to a white wall at 1 m.
    pub(super) fn cast(
        &mut self,
        caster: &Caster,
        origin: Pose,
        advance_m: f64,
        phase: usize,
        gain: impl Fn(&Return) -> f64,
    ) {
        let advance_m = advance_m / self.grid.fold as f64;
        self.fan.advance(advance_m);
        let first_m = origin.y_m - self.margin as f64 * advance_m;
        let count = self.fan.len();
        let planes = self.grid.planes(phase);
        self.planes = planes.len();
        self.returns.resize(count * planes.len(), Return::MISS);
        self.rays.clear();
        let (mut widest_rad, half_sweep_rad) = (0.0_f64, self.grid.half_sweep_rad);
        for (plane, returns) in planes.iter().zip(self.returns.chunks_exact_mut(count.max(1))) {
            let from = beside(Pose { y_m: first_m, ..origin }, &self.fan, plane.y_m);
            caster.cast(from, &self.fan, &mut self.scratch, returns);
            self.rays.extend(returns.iter().map(|found| {
                if !found.is_hit() {
                    return Ray::default();
                }
                let extent = plane.extent(found.range_m, half_sweep_rad);
                widest_rad = widest_rad.max(extent.half_rad + extent.sweep_rad);
                Ray { range_m: found.range_m, gain: gain(found), extent }
            }));
        }
        self.reach = self.grid.rays_within(widest_rad).min(self.margin);
    }

    /// What a beam's parts met, plane by plane.
    pub(super) fn gather(&self, beam: usize, touches: &mut Vec<Touch>) {
        let axis = self.margin + beam * self.grid.fold;
        let first = axis - self.reach;
        for plane in 0..self.planes {
            let start = plane * self.fan.len() + first;
            let rays = self.rays.get(start..=start + 2 * self.reach).unwrap_or(&[]);
            for (number, ray) in rays.iter().enumerate() {
                if ray.extent.share <= 0.0 {
                    continue;
                }
                let share = self.grid.weight(ray.extent, number as isize - self.reach as isize);
                if share > 0.0 {
                    let Ray { range_m, gain, .. } = *ray;
                    touches.push(Touch { range_m, share, power: share * gain, ray: (start + number) as u32 });
                }
            }
        }
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
