//! Rain drops and snow flakes that are echoes of their own: Poisson in number, exponential in size.

use rowscan_protocol::optics::Optics;

use crate::optics::draws::Draws;
use crate::optics::touch::{NO_RAY, Touch};

/// Reflectance of a water drop \[S19\].
pub(super) const WATER: f64 = 0.02;

/// Reflectance of snow \[ASM\].
const SNOW: f64 = 0.8;

/// Drops nearer than this are on the window, metres.
const NEAREST_M: f64 = 0.1;

/// Drops farther than this are never large enough to matter, metres.
pub(super) const FARTHEST_M: f64 = 30.0;

/// The lightest snow that sizes of flakes are taken of, mm/h of water \[ASM\].
const LIGHTEST_SNOW_MM_H: f64 = 0.5;
/// Steps of the table, even in the logarithm of the range.
const STEPS: usize = 200;

/// Drops that answer, along one beam.
#[derive(Clone, Debug)]
pub(super) struct Drops {
    reflectance: f64,
    /// Mean diameter beyond the least one, mm.
    mean_mm: f64,
    least_power: f64,
    /// Mean number up to each step's range.
    table: Vec<Step>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Step {
    range_m: f64,
    mean: f64,
    spot_m: f64,
}

impl Drops {
    /// Marshall and Palmer \[S19\].
    pub(super) fn rain(optics: &Optics, mm_h: f64, reflectance: f64) -> Self {
        Self::new(optics, 8000.0, 4.1 * libm::pow(mm_h, -0.21), reflectance)
    }

    /// Marshall and Gunn \[S19\]. By their formula lighter snow has more flakes, without a bound. Below [`LIGHTEST_SNOW_MM_H`] flakes are therefore as large as at
    /// that rate, and their number goes with the rate.
    pub(super) fn snow(optics: &Optics, mm_h: f64) -> Self {
        let of = mm_h.max(LIGHTEST_SNOW_MM_H);
        let fewer = mm_h / of;
        Self::new(optics, fewer * 7600.0 * libm::pow(of, -0.87), 2.55 * libm::pow(of, -0.48), SNOW)
    }

    /// N(D) = `per_m3_mm` · exp(−`slope` · D), D in mm.
    fn new(optics: &Optics, per_m3_mm: f64, slope: f64, reflectance: f64) -> Self {
        let least_power = optics.least_power();
        let growth = libm::pow(FARTHEST_M / NEAREST_M, 1.0 / STEPS as f64);
        let mut table = Vec::with_capacity(STEPS + 1);
        let (mut range_m, mut mean) = (NEAREST_M, 0.0);
        for _ in 0..=STEPS {
            let spot_m = optics.spot.nominal_m(range_m);
            table.push(Step { range_m, mean, spot_m });
            let (next_m, middle_m) = (range_m * growth, range_m * growth.sqrt());
            let spot_m = optics.spot.nominal_m(middle_m);
            let least_mm = 1e3 * spot_m * (least_power / reflectance).sqrt() * middle_m;
            let per_m3 = per_m3_mm / slope * libm::exp(-slope * least_mm);
            mean += std::f64::consts::FRAC_PI_4 * spot_m * spot_m * per_m3 * (next_m - range_m);
            range_m = next_m;
        }
        Self { reflectance, mean_mm: 1.0 / slope, least_power, table }
    }

    /// Mean number of drops that answer from nearer than this.
    pub(super) fn mean(&self, range_m: f64) -> f64 {
        let after = self.table.partition_point(|step| step.range_m < range_m);
        let (Some(last), Some(next)) = (self.table.get(after.saturating_sub(1)), self.table.get(after))
        else {
            return self.table.last().map_or(0.0, |step| step.mean);
        };
        let part = (range_m - last.range_m) / (next.range_m - last.range_m).max(f64::MIN_POSITIVE);
        last.mean + part.clamp(0.0, 1.0) * (next.mean - last.mean)
    }

    /// Adds the drops of one shot before what stands at `free_m`.
    pub(super) fn act(&self, mut draws: Draws, free_m: f64, touches: &mut Vec<Touch>) {
        let mean = self.mean(free_m);
        // Knuth's product; means are of order 1.
        let (limit, mut product) = (libm::exp(-mean), draws.unit());
        while product > limit {
            touches.extend(self.drop(mean * draws.unit(), &mut draws));
            product *= draws.unit();
        }
    }

    /// The drop before which there are so many in the mean.
    fn drop(&self, mean: f64, draws: &mut Draws) -> Option<Touch> {
        let after = self.table.partition_point(|step| step.mean < mean).max(1);
        let (near, far) = (self.table.get(after - 1)?, self.table.get(after)?);
        let part = (mean - near.mean) / (far.mean - near.mean).max(f64::MIN_POSITIVE);
        let range_m = near.range_m + part.clamp(0.0, 1.0) * (far.range_m - near.range_m);
        let spot_m = near.spot_m + part.clamp(0.0, 1.0) * (far.spot_m - near.spot_m);
        let least_m = spot_m * (self.least_power / self.reflectance).sqrt() * range_m;
        let diameter_m = least_m - 1e-3 * self.mean_mm * libm::log(1.0 - draws.unit());
        let share = (diameter_m / spot_m) * (diameter_m / spot_m);
        let power = self.reflectance * share / (range_m * range_m);
        Some(Touch { range_m, share, power, ray: NO_RAY })
    }
}

/// Extinction by rain, 1/m: 2 · π/4 · ∫ D² N dD.
pub(super) fn extinction_of_rain(mm_h: f64) -> f64 {
    if mm_h <= 0.0 {
        return 0.0;
    }
    let slope = 4.1 * libm::pow(mm_h, -0.21);
    std::f64::consts::FRAC_PI_2 * 1e-6 * 8000.0 * 2.0 / (slope * slope * slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::model::AnyModel;

    #[test]
    fn rain_dims_as_its_integral_says() {
        // OPTICS.md 4, per km.
        for (mm_h, per_km) in [(1.0, 0.37), (5.0, 1.0), (10.0, 1.6), (25.0, 2.8), (50.0, 4.3)] {
            let found = 1e3 * extinction_of_rain(mm_h);
            assert!((found / per_km - 1.0).abs() < 0.05, "{mm_h} mm/h: {found} /km");
        }
    }

    #[test]
    fn drops_that_answer_are_as_many_as_the_table_says() {
        for (model, means) in [
            ("lms111", [0.0165, 0.054, 0.121]),
            ("lms511", [0.068, 0.211, 0.453]),
            ("tim561", [0.0039, 0.0150, 0.0355]),
        ] {
            let optics = AnyModel::by_name(model).unwrap().optics();
            for (mm_h, mean) in [1.0, 10.0, 50.0].into_iter().zip(means) {
                let found = Drops::rain(optics, mm_h, WATER).mean(4.0);
                assert!((found / mean - 1.0).abs() < 0.06, "{model} {mm_h} mm/h: {found}, {mean}");
            }
        }
    }

    #[test]
    fn hardly_any_snow_returns_hardly_any_beam() {
        let optics = AnyModel::by_name("lms111").unwrap().optics();
        let mean = |mm_h: f64| Drops::snow(optics, mm_h).mean(4.0);
        let lightest = mean(LIGHTEST_SNOW_MM_H);
        for share in [1e-4, 0.01, 0.1, 0.5] {
            let found = mean(share * LIGHTEST_SNOW_MM_H) / lightest;
            assert!((found / share - 1.0).abs() < 1e-9, "{share}: {found}");
        }
    }

    #[test]
    fn their_number_is_poisson() {
        let optics = AnyModel::by_name("lms511").unwrap().optics();
        let drops = Drops::rain(optics, 50.0, WATER);
        let (shots, mean) = (20_000_u32, drops.mean(4.0));
        let mut counts = [0.0_f64; 4];
        for shot in 0..shots {
            let mut touches = Vec::new();
            drops.act(Draws::of(1, crate::optics::draws::Use::Drops, u64::from(shot)), 4.0, &mut touches);
            assert!(touches.iter().all(|drop| drop.power >= 0.999 * optics.least_power()));
            *counts.get_mut(touches.len().min(3)).unwrap() += 1.0;
        }
        let p = [1.0, mean, mean * mean / 2.0].map(|term| term * (-mean).exp());
        let rest = 1.0 - p.iter().sum::<f64>();
        let expected = p.into_iter().chain([rest]).map(|p| p * f64::from(shots));
        let chi2: f64 = counts.iter().zip(expected).map(|(n, e)| (n - e) * (n - e) / e).sum();
        // p > 0.01 with three degrees of freedom.
        assert!(chi2 < 11.34, "{chi2}");
    }
}
