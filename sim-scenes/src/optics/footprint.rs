//! The footprints of a line's beams: planes and rays cast once, shared by all beams that they lie in.

use pulp::{Arch, Simd, WithSimd};
use rowscan_protocol::scan::Pose;

use super::spot::{Extent, Extents, SpotGrid};
use super::touch::Touch;
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
    planes: usize,
    /// Rays to each side that the widest spot of the line reaches.
    reach: usize,
}

/// Rays, plane by plane, ready for the beams that they lie in. What met nothing has no share.
#[derive(Clone, Debug, Default)]
struct Rays {
    range_m: Vec<f64>,
    /// Power that comes back of a share of 1.
    gain: Vec<f64>,
    share: Vec<f64>,
    half_rad: Vec<f64>,
    sweep_rad: Vec<f64>,
}

impl Rays {
    /// Room for so many, and for reading a register from any of them on. None of them has met anything.
    fn reset(&mut self, count: usize) {
        let Self { range_m, gain, share, half_rad, sweep_rad } = self;
        for list in [range_m, gain, share, half_rad, sweep_rad] {
            list.clear();
            list.resize(count + WIDTH, 0.0);
        }
    }

    fn set(&mut self, ray: usize, range_m: f64, gain: f64, extent: Extent) {
        let Extent { share, half_rad, sweep_rad } = extent;
        let values = [range_m, gain, share, half_rad, sweep_rad];
        let Self { range_m, gain, share, half_rad, sweep_rad } = self;
        for (list, value) in [range_m, gain, share, half_rad, sweep_rad].into_iter().zip(values) {
            if let Some(place) = list.get_mut(ray) {
                *place = value;
            }
        }
    }

    #[inline(always)]
    fn extents<S: Simd>(&self, simd: S, from: usize) -> Option<Extents<S>> {
        Some(Extents {
            share: Lanes::read(simd, &self.share, from)?,
            half_rad: Lanes::read(simd, &self.half_rad, from)?,
            sweep_rad: Lanes::read(simd, &self.sweep_rad, from)?,
        })
    }

    /// What a beam met of ray `ray`, with this share of its power.
    fn touch(&self, ray: usize, share: f64) -> Option<Touch> {
        let (range_m, gain) = (*self.range_m.get(ray)?, *self.gain.get(ray)?);
        Some(Touch { range_m, share, power: share * gain, ray: ray as u32 })
    }
}

/// Gathers what a beam's parts met.
struct Gather<'a> {
    footprint: &'a Footprint,
    beam: usize,
    touches: &'a mut Vec<Touch>,
}

impl WithSimd for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { footprint: Footprint { grid, fan, margin, rays, planes, reach, .. }, beam, touches } =
            self;
        let first = margin + beam * grid.fold - reach;
        let count = 2 * reach + 1;
        for plane in 0..*planes {
            let start = plane * fan.len() + first;
            for from in (0..count).step_by(WIDTH) {
                let mut shares = Row::splat(0.0);
                for part in 0..Row::parts::<S>() {
                    let number = from + part * S::F64_LANES;
                    let Some(extents) = rays.extents(simd, start + number) else { break };
                    let off = Lanes::count_from(simd, number) - Lanes::splat(simd, *reach as f64);
                    shares.store(part, grid.weights(extents, off));
                }
                for (number, share) in shares.0.iter().enumerate().take(count - from) {
                    if *share > 0.0 {
                        touches.extend(rays.touch(start + from + number, *share));
                    }
                }
            }
        }
    }
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
            rays: Rays::default(),
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
        self.rays.reset(count * planes.len());
        let (mut widest_rad, half_sweep_rad) = (0.0_f64, self.grid.half_sweep_rad);
        let mut ray = 0;
        for (plane, returns) in planes.iter().zip(self.returns.chunks_exact_mut(count.max(1))) {
            let from = beside(Pose { y_m: first_m, ..origin }, &self.fan, plane.y_m);
            caster.cast(from, &self.fan, &mut self.scratch, returns);
            for found in returns {
                if found.is_hit() {
                    let extent = plane.extent(found.range_m, half_sweep_rad);
                    widest_rad = widest_rad.max(extent.half_rad + extent.sweep_rad);
                    self.rays.set(ray, found.range_m, gain(found), extent);
                }
                ray += 1;
            }
        }
        self.reach = self.grid.rays_within(widest_rad).min(self.margin);
    }

    /// What a beam's parts met, plane by plane.
    pub(super) fn gather(&self, beam: usize, touches: &mut Vec<Touch>) {
        Arch::new().dispatch(Gather { footprint: self, beam, touches });
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
