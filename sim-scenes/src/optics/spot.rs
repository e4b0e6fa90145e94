//! The spot as planes and rays: which part of a spot's power a ray stands for, at the range of what it met.
//!
//! All planes are parallel, so where a spot is smaller than at the reference range, fewer of them are within it. Each plane stands for the strip of
//! the disc between it and its neighbours, each ray for its cell of the strip; the parts of one range add up to 1 exactly.

use pulp::Simd;
use rowscan_protocol::optics::Spot;

use super::settings::OpticsSettings;
use crate::lanes::Lanes;

/// Different places of the plane grid; a line takes one of them at random, so that errors average out over lines.
pub(super) const PHASES: usize = 8;

/// Ranges at which strips are tabulated: even in r / (r + [`BEND_M`]).
const KNOTS: usize = 256;
const BEND_M: f64 = 2.0;

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
    /// By range.
    strips: Vec<Strip>,
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

/// What a ray stands for: a strip's share, spread over an angle: a box with the ends that a second box makes by being swept over it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Extent {
    pub(super) share: f64,
    pub(super) half_rad: f64,
    pub(super) sweep_rad: f64,
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
        let plane = Plane { y_m: 0.0, strips: vec![strip; KNOTS] };
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

    /// The parts of a beam's power that rays stand for which lie `rays_off` rays from the beam's axis.
    #[inline(always)]
    pub(super) fn weights<S: Simd>(&self, extents: Extents<S>, rays_off: Lanes<S>) -> Lanes<S> {
        let Extents { share, half_rad, .. } = extents;
        let zero = share.of(0.0);
        let middle = rays_off * zero.of(self.step_rad);
        let (from, to) = (middle - zero.of(self.step_rad / 2.0), middle + zero.of(self.step_rad / 2.0));
        let weight = share * (extents.below(to) - extents.below(from));
        let on_axis = rays_off.le(zero).and(zero.le(rays_off));
        half_rad.le(zero).select(on_axis.select(share, zero), weight)
    }
}

/// What a register of rays stand for.
#[derive(Clone, Copy)]
pub(super) struct Extents<S: Simd> {
    pub(super) share: Lanes<S>,
    pub(super) half_rad: Lanes<S>,
    pub(super) sweep_rad: Lanes<S>,
}

impl<S: Simd> Extents<S> {
    /// Share of the power at angles below `angle`, of strips ±half swept over ±sweep.
    #[inline(always)]
    fn below(self, angle: Lanes<S>) -> Lanes<S> {
        let Self { half_rad: half, sweep_rad: sweep, .. } = self;
        let (zero, one) = (angle.of(0.0), angle.of(1.0));
        let still = (angle + half) / (one.of(2.0) * half);
        let sum = square(angle + half + sweep) - square(angle + half - sweep) - square(angle - half + sweep)
            + square(angle - half - sweep);
        let swept = sum / (one.of(8.0) * half * sweep);
        sweep.le(zero).select(still, swept).max(zero).min(one)
    }
}

/// The square of what is positive.
#[inline(always)]
fn square<S: Simd>(x: Lanes<S>) -> Lanes<S> {
    let positive = x.max(x.of(0.0));
    positive * positive
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
        let strips = (0..KNOTS).map(|knot| {
            let place = knot as f64 / KNOTS as f64;
            Strip::of(spot.radius_m(BEND_M * place / (1.0 - place)), low_m, high_m)
        });
        Self { y_m, strips: strips.collect() }
    }

    /// What a ray of this plane stands for that met something at this range.
    pub(super) fn extent(&self, range_m: f64, half_sweep_rad: f64) -> Extent {
        let range_m = range_m.max(NEAREST_M);
        let at = range_m / (range_m + BEND_M) * KNOTS as f64;
        let knot = (at as usize).min(KNOTS - 2);
        let (Some(near), Some(far)) = (self.strips.get(knot), self.strips.get(knot + 1)) else {
            return Extent::default();
        };
        let part = (at - knot as f64).min(1.0);
        let between = |near: f64, far: f64| near + part * (far - near);
        let slant_rad = between(near.slant_m, far.slant_m) / range_m;
        Extent {
            share: between(near.share, far.share),
            half_rad: between(near.half_m, far.half_m) / range_m,
            // Two boxes in a row are nearly one of their variance.
            sweep_rad: (slant_rad * slant_rad + half_sweep_rad * half_sweep_rad).sqrt(),
        }
    }
}

impl Strip {
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
    use crate::lanes::Row;
    use rowscan_protocol::optics::Fact;

    fn one(value: f64) -> Lanes<pulp::Scalar> {
        Lanes::splat(pulp::Scalar::new(), value)
    }

    fn extents(Extent { share, half_rad, sweep_rad }: Extent) -> Extents<pulp::Scalar> {
        Extents { share: one(share), half_rad: one(half_rad), sweep_rad: one(sweep_rad) }
    }

    fn value(lanes: Lanes<pulp::Scalar>) -> f64 {
        let mut row = Row::splat(0.0);
        row.store(0, lanes);
        row.0[0]
    }

    fn below(angle: f64, half_rad: f64, sweep_rad: f64) -> f64 {
        value(extents(Extent { share: 1.0, half_rad, sweep_rad }).below(one(angle)))
    }

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
                let sum: f64 = grid
                    .planes(phase)
                    .iter()
                    .map(|plane| {
                        let extent = plane.extent(range_m, grid.half_sweep_rad);
                        let reach = grid.margin() as isize;
                        (-reach..=reach)
                            .map(|off| value(grid.weights(extents(extent), one(off as f64))))
                            .sum::<f64>()
                    })
                    .sum();
                assert!((sum - 1.0).abs() < 1e-9, "quality {quality}, {range_m} m: {sum}");
            }
        }
    }

    #[test]
    fn a_swept_box_is_as_wide_as_spot_and_box_and_has_its_variance() {
        let (half, sweep) = (4.3e-3, 2.9e-3);
        assert!(below(-half - sweep, half, sweep) <= 0.0 && below(half + sweep, half, sweep) >= 1.0);
        let n = 4000;
        let width = half + sweep;
        let variance: f64 = (0..n)
            .map(|i| {
                let (from, to) = (f64::from(i), f64::from(i + 1));
                let at = |i: f64| width * (2.0 * i / f64::from(n) - 1.0);
                (below(at(to), half, sweep) - below(at(from), half, sweep)) * at((from + to) / 2.0).powi(2)
            })
            .sum();
        let expected = (half * half + sweep * sweep) / 3.0;
        assert!((variance / expected - 1.0).abs() < 1e-5, "{variance} {expected}");
    }
}
