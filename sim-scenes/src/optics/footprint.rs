//! The footprints of a line's beams: planes and rays cast once, shared by all beams that they lie in.

use pulp::{Arch, Simd, WithSimd};
use rowscan_protocol::scan::Pose;

use super::parts::{Column, Parts};
use super::rays::{Rays, Weigh};
use super::spot::SpotGrid;
use crate::caster::{BeamFan, Caster, Cone, Return, Scratch};
use crate::lanes::{Lanes, Row, WIDTH};

/// The casts of one line, and room for the next.
#[derive(Clone, Debug)]
pub(super) struct Footprint {
    grid: SpotGrid,
    fan: BeamFan,
    /// The fan as it is cast.
    cone: Cone,
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
    /// For the beams of `fan`, sampled as `grid` says, whose plane is bent by `bend_rad`.
    pub(super) fn new(grid: SpotGrid, fan: &BeamFan, bend_rad: f64) -> Self {
        let (margin, beams) = (grid.margin(), fan.len());
        let fan = fan.refined(grid.fold, margin);
        let planes = grid.planes(0).len();
        Self {
            rays: Rays::new(planes, fan.len(), &grid, margin, beams),
            returns: vec![Return::MISS; planes * fan.len()],
            cone: Cone::new(&fan, bend_rad),
            fan,
            margin,
            beams,
            grid,
            scratch: Scratch::default(),
        }
    }

    /// The same beams in other directions.
    pub(super) fn tilt(&mut self, fan: &BeamFan, bend_rad: f64) {
        self.fan = fan.refined(self.grid.fold, self.margin);
        self.cone = Cone::new(&self.fan, bend_rad);
    }

    /// The same beams in a plane that leans so.
    pub(super) fn lean(&mut self, fan: &BeamFan) {
        self.fan.lean(fan.axes().copied());
        self.cone.lean(fan);
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
        let Self { grid, fan, cone, margin, scratch, returns, rays, .. } = self;
        let advance_m = advance_m / grid.fold as f64;
        let origin = Pose { y_m: origin.y_m - *margin as f64 * advance_m, ..origin };
        let lines = returns.chunks_exact_mut(fan.len().max(1));
        for (number, (plane, returns)) in grid.planes(phase).iter().zip(lines).enumerate() {
            cone.cast(caster, (origin, plane.y_m), advance_m, scratch, returns);
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

#[cfg(test)]
mod tests {
    use pulp::Scalar;
    use rowscan_protocol::model::AnyModel;

    use super::*;
    use crate::caster::Class;
    use crate::optics::settings::OpticsSettings;
    use crate::optics::swept::SweptRow;
    use crate::optics::touch::Touch;
    use crate::seed::Purpose;

    /// 43 beams whose rays met surfaces at random, or nothing; on the widest registers and one number at a time.
    fn footprints(model: &str, quality: u8) -> [Footprint; 2] {
        let spot = AnyModel::by_name(model).unwrap().optics().spot;
        let fan = BeamFan::from_degrees(-9.0, 0.5, 43);
        let settings = OpticsSettings { quality, ..OpticsSettings::default() };
        let mut footprint = Footprint::new(SpotGrid::new(&spot, &settings, fan.step_rad()), &fan, 0.0);
        let mut stream = Purpose::Growth.stream(3, 0, 0);
        for found in &mut footprint.returns {
            // Most are far away, some so near that many beams see them.
            let range_m = [9.0, 2.0, 2.0, 0.3].map(|most| 0.05 + most * stream.unit());
            if stream.unit() < 0.6 {
                let range_m = range_m[(stream.unit() * 4.0) as usize];
                *found = Return { range_m, class: Class::Leaf, ..Return::MISS };
            }
        }
        let mut single = footprint.clone();
        for (footprint, wide) in [(&mut footprint, true), (&mut single, false)] {
            let Footprint { grid, fan, margin, returns, rays, .. } = footprint;
            for (number, (plane, returns)) in
                grid.planes(1).iter().zip(returns.chunks_exact(fan.len())).enumerate()
            {
                rays.fill(number, returns, |_| 1.0);
                let weigh = Weigh { rays, grid, number, plane, margin: *margin };
                if wide { Arch::new().dispatch(weigh) } else { weigh.with_simd(Scalar::new()) }
            }
        }
        [footprint, single]
    }

    #[test]
    fn a_beam_gathers_every_ray_of_its_spot_by_its_weight_on_any_register_width() {
        for (model, quality) in [("lms511", 2), ("tim781s", 1), ("lms111", 4)] {
            let [footprint, single] = footprints(model, quality);
            let [mut parts, mut again] = [Parts::default(), Parts::default()];
            for row in 0..footprint.beams.div_ceil(WIDTH) {
                footprint.gather(row, &mut parts);
                again.reset(footprint.grid.fold);
                Gather { footprint: &single, row, parts: &mut again }.with_simd(Scalar::new());
                for (lane, beam) in (row * WIDTH..footprint.beams).take(WIDTH).enumerate() {
                    let found: Vec<Touch> = parts.beam(lane).collect();
                    assert!(again.beam(lane).eq(found.iter().copied()), "{model}, beam {beam}");
                    assert_eq!(found, asked(&footprint, beam), "{model}, beam {beam}");
                }
            }
        }
    }

    /// What a beam met, by asking every ray.
    fn asked(Footprint { grid, fan, margin, returns, .. }: &Footprint, beam: usize) -> Vec<Touch> {
        let axis = margin + beam * grid.fold;
        let planes = grid.planes(1).iter().zip(returns.chunks_exact(fan.len()));
        let rays =
            planes.flat_map(|(plane, returns)| returns.iter().enumerate().map(move |ray| (plane, ray)));
        let near =
            rays.enumerate().filter(|(_, (_, (ray, found)))| ray.abs_diff(axis) <= *margin && found.is_hit());
        let touches = near.map(|(number, (plane, (ray, found)))| {
            let (mut swept, mut share) = (SweptRow::default(), Row::splat(0.0));
            let rows = [&Row::splat(found.range_m), &Row::splat(1.0)];
            let gain = plane.sweep(Scalar::new(), rows, grid, &mut swept).0[0];
            share.store(0, swept.load(Scalar::new(), 0).weight(ray.abs_diff(axis), grid.step_rad));
            let share = share.0[0];
            Touch { range_m: found.range_m, share, power: share * gain, ray: number as u32 }
        });
        touches.filter(|touch| touch.share > 0.0).collect()
    }
}
