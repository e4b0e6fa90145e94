//! The spot as planes and rays: which part of a spot's power a ray stands for, at the range of what it met.
//!
//! All planes are parallel, so where a spot is smaller than at the reference range, fewer of them are within it. Each plane stands for the strip of
//! the disc between it and its neighbours, each ray for its cell of the strip; the parts of one range add up to 1 exactly.

use pulp::Simd;
use rowscan_protocol::optics::Spot;

use super::settings::OpticsSettings;
use super::swept::{Swept, SweptRow};
use crate::lanes::{Lanes, Row, WIDTH};

/// Different places of the plane grid; a line takes one of them at random, so that errors average out over lines.
pub(super) const PHASES: usize = 8;

/// Ranges at which strips are tabulated: even in r / (r + [`BEND_M`]).
const KNOTS: usize = 256;
const BEND_M: f64 = 2.0;

/// Added to a number, this leaves the nearest whole number in its low bits.
const UNITS: f64 = (1u64 << 52) as f64;

/// Nearer than this a spot takes up no larger angle, metres.
const NEAREST_M: f64 = 0.1;

/// How the spots of a fan are sampled.
#[derive(Clone, Debug)]
pub(super) struct SpotGrid {
    /// Rays from beam to beam.
    pub(super) fold: usize,
    /// Angle from ray to ray.
    pub(super) step_rad: f64,
    /// Half of the angle that the mirror turns through in a shot.
    pub(super) half_sweep_rad: f64,
    /// One for each phase.
    phases: Vec<Vec<Plane>>,
    /// The largest half angle of a spot.
    widest_rad: f64,
}

/// One plane.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    /// Its place along Y.
    pub(super) y_m: f64,
    /// By range: the strip at a knot, and what it gains until the next.
    strips: Vec<[Strip; 2]>,
}

/// The part of the disc that a plane stands for.
#[derive(Clone, Copy, Debug, Default)]
struct Strip {
    /// Its share of the disc.
    share: f64,
    /// Half of its mean length, metres.
    half_m: f64,
    /// Its longest half length beyond that, metres: its ends are slanted.
    slant_m: f64,
}

impl SpotGrid {
    /// For beams `pitch_rad` apart.
    pub(super) fn new(spot: &Spot, settings: &OpticsSettings, pitch_rad: f64) -> Self {
        let (planes, rays) = settings.grid();
        let reference_m = settings.reference_range_m;
        let radius_m = spot.radius_m(reference_m);
        let sweep_rad = 1e-3 * spot.effective.value * spot.sweep_mrad.value;
        let width_rad = 2.0 * radius_m / reference_m + sweep_rad;
        let fold = ((rays as f64 * pitch_rad / width_rad).round() as usize).max(1);
        let apart_m = 2.0 * radius_m / planes as f64;
        let phases = (0..PHASES).map(|phase| {
            let shift = (phase as f64 + 0.5) / PHASES as f64 - 0.5;
            let first_m = (shift - (planes as f64 - 1.0) / 2.0) * apart_m;
            Plane::grid(spot, first_m, apart_m, planes)
        });
        Self {
            fold,
            step_rad: pitch_rad / fold as f64,
            half_sweep_rad: sweep_rad / 2.0,
            phases: phases.collect(),
            widest_rad: spot.radius_m(NEAREST_M) / NEAREST_M + sweep_rad / 2.0,
        }
    }

    /// One ray a beam, without width.
    pub(super) fn thin(pitch_rad: f64) -> Self {
        let strip = Strip { share: 1.0, half_m: 0.0, slant_m: 0.0 };
        let plane = Plane { y_m: 0.0, strips: vec![[strip, Strip::default()]; KNOTS - 1] };
        Self {
            fold: 1,
            step_rad: pitch_rad,
            half_sweep_rad: 0.0,
            phases: vec![vec![plane]; PHASES],
            widest_rad: 0.0,
        }
    }

    /// The planes of a phase.
    pub(super) fn planes(&self, phase: usize) -> &[Plane] {
        self.phases.get(phase % PHASES).map_or(&[], Vec::as_slice)
    }

    /// How many rays beyond the outermost beams the spots reach.
    pub(super) fn margin(&self) -> usize {
        self.rays_within(self.widest_rad)
    }

    /// How many rays to each side a spot of this half angle reaches.
    pub(super) fn rays_within(&self, half_rad: f64) -> usize {
        if half_rad > 0.0 { (half_rad / self.step_rad + 0.5).ceil() as usize } else { 0 }
    }
}

impl Plane {
    /// Evenly spaced planes; the outermost stand for all that is beyond them.
    fn grid(spot: &Spot, first_m: f64, apart_m: f64, planes: usize) -> Vec<Self> {
        let one = |plane: usize| {
            let y_m = first_m + plane as f64 * apart_m;
            let low_m = if plane == 0 { f64::NEG_INFINITY } else { y_m - apart_m / 2.0 };
            let high_m = if plane + 1 == planes { f64::INFINITY } else { y_m + apart_m / 2.0 };
            Self::new(spot, y_m, low_m, high_m)
        };
        (0..planes).map(one).collect()
    }

    fn new(spot: &Spot, y_m: f64, low_m: f64, high_m: f64) -> Self {
        let strip = |knot: usize| {
            let place = knot as f64 / KNOTS as f64;
            Strip::of(spot.radius_m(BEND_M * place / (1.0 - place)), low_m, high_m)
        };
        let strips = (1..KNOTS).map(|next| {
            let near = strip(next - 1);
            [near, strip(next).beyond(near)]
        });
        Self { y_m, strips: strips.collect() }
    }

    /// What eight rays of this plane stand for that met something at these ranges: nothing where a range is infinite. Gives what comes back of a
    /// share of 1, by what would at 1 m.
    #[inline(always)]
    pub(super) fn sweep<S: Simd>(
        &self,
        simd: S,
        [range_m, surface]: [&Row; 2],
        grid: &SpotGrid,
        out: &mut SweptRow,
    ) -> Row {
        let one = Lanes::splat(simd, 1.0);
        let [mut knots, mut parts, mut per_m] = [Row::splat(0.0); 3];
        for part in 0..Row::parts::<S>() {
            let range = range_m.load(simd, part);
            let range = range.lt(one.of(f64::INFINITY)).select(range.max(one.of(NEAREST_M)), one);
            // One division for both ratios.
            let bent = range + one.of(BEND_M);
            let inverse = one / (range * bent);
            let at = range * range * inverse * one.of(KNOTS as f64);
            let knot = (at - one.of(0.5) + one.of(UNITS)).min(one.of((KNOTS - 2) as f64 + UNITS));
            knots.store(part, knot);
            parts.store(part, (at - (knot - one.of(UNITS))).min(one));
            per_m.store(part, bent * inverse);
        }
        let mut strips = [Row::splat(0.0); 6];
        for lane in 0..WIDTH {
            let knot = (knots.0[lane].to_bits() & u64::from(u32::MAX)) as usize;
            let Some([near, rise]) = self.strips.get(knot) else { continue };
            let values = [near.share, near.half_m, near.slant_m, rise.share, rise.half_m, rise.slant_m];
            for (row, value) in strips.iter_mut().zip(values) {
                row.0[lane] = value;
            }
        }
        let (half_sweep, sweeps) = (one.of(grid.half_sweep_rad), grid.half_sweep_rad > 0.0);
        let mut gain = Row::splat(0.0);
        for part in 0..Row::parts::<S>() {
            let [near_share, near_half, near_slant, share, half, slant] = &strips;
            let (along, per_m) = (parts.load(simd, part), per_m.load(simd, part));
            let share = near_share.load(simd, part) + along * share.load(simd, part);
            let half_rad = (near_half.load(simd, part) + along * half.load(simd, part)) * per_m;
            let slant_rad = (near_slant.load(simd, part) + along * slant.load(simd, part)) * per_m;
            let met = range_m.load(simd, part).lt(one.of(f64::INFINITY));
            // Two boxes in a row are nearly one of their variance.
            let sweep_rad =
                if sweeps { (slant_rad * slant_rad + half_sweep * half_sweep).sqrt() } else { slant_rad };
            let share = met.select(share, one.of(0.0));
            let range = met.select(range_m.load(simd, part), one);
            let back = [surface.load(simd, part), range * range];
            let (swept, back) = Swept::new(share, half_rad, sweep_rad, grid.step_rad, back);
            out.store(part, swept);
            gain.store(part, back);
        }
        gain
    }
}

impl Strip {
    /// What it has more than another.
    fn beyond(self, other: Self) -> Self {
        Self {
            share: self.share - other.share,
            half_m: self.half_m - other.half_m,
            slant_m: self.slant_m - other.slant_m,
        }
    }

    /// Of a disc of this radius, between two places.
    fn of(radius_m: f64, low_m: f64, high_m: f64) -> Self {
        let (low, high) = ((low_m / radius_m).clamp(-1.0, 1.0), (high_m / radius_m).clamp(-1.0, 1.0));
        let height = high - low;
        if height <= 0.0 {
            return Self::default();
        }
        let primitive = |y: f64| y * (1.0 - y * y).max(0.0).sqrt() + libm::asin(y);
        let area = primitive(high) - primitive(low);
        let mean = area / (2.0 * height);
        let half = |y: f64| (1.0 - y * y).max(0.0).sqrt();
        let longest = if low <= 0.0 && high >= 0.0 { 1.0 } else { half(low).max(half(high)) };
        Self {
            share: area / std::f64::consts::PI,
            half_m: radius_m * mean,
            slant_m: radius_m * (longest - mean).max(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::optics::Fact;

    fn spot(sweep_mrad: f64) -> Spot {
        Spot {
            exit_mm: Fact::assumed(8.0),
            divergence_mrad: Fact::assumed(15.0),
            sweep_mrad: Fact::assumed(sweep_mrad),
            effective: Fact::assumed(0.9),
        }
    }

    #[test]
    fn the_parts_of_one_surface_add_up_to_one_at_any_range_and_phase() {
        for (quality, sweep_mrad) in [(1, 0.0), (2, 0.0), (2, 5.8), (4, 17.5)] {
            let settings = OpticsSettings { quality, ..OpticsSettings::default() };
            let grid = SpotGrid::new(&spot(sweep_mrad), &settings, 0.0087);
            for (phase, range_m) in
                (0..PHASES).flat_map(|phase| [0.11, 0.7, 1.93, 4.0, 17.0].map(|r| (phase, r)))
            {
                let simd = pulp::Scalar::new();
                let weight = |plane: &Plane, off| {
                    let (mut swept, mut weights) = (SweptRow::default(), Row::splat(0.0));
                    plane.sweep(simd, [&Row::splat(range_m); 2], &grid, &mut swept);
                    weights.store(0, swept.load(simd, 0).weight(off, grid.step_rad));
                    weights.0[0]
                };
                let all = |plane| {
                    let beside: f64 = (1..=grid.margin()).map(|off| weight(plane, off)).sum();
                    weight(plane, 0) + 2.0 * beside
                };
                let sum: f64 = grid.planes(phase).iter().map(all).sum();
                assert!((sum - 1.0).abs() < 1e-9, "quality {quality}, {range_m} m: {sum}");
            }
        }
    }
}
