//! Laws of leaf inclination: the angle between a blade's normal and the vertical, equal to that between blade and horizontal.

use glam::DVec3;

use super::rotation;
use crate::angle::cos_sin_deg;
use crate::parameters::choices;
use crate::seed::Stream;

choices! {
    /// Law of the blades' inclinations.
    pub enum LeafAngle {
        /// What insertion, droop and twist give.
        AsInserted = "as_inserted",
        /// As the surface of a sphere: density sin θ.
        Spherical = "spherical",
        /// As the surface of a spheroid with the given ratio of axes (Campbell 1986).
        Ellipsoidal = "ellipsoidal",
        /// Beta law with the given mean and deviation (Goel and Strebel 1984).
        Beta = "beta",
    }
}

/// Steps in which a law is summed up before it is drawn from.
const STEPS: u32 = 900;

const STEP_DEG: f64 = 0.1;

/// A law of inclination with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafAngleLaw {
    /// Which law.
    pub kind: LeafAngle,
    /// Ratio of horizontal to vertical projections of the ellipsoidal law.
    pub chi: f64,
    /// Mean inclination of the beta law, degrees from the horizontal.
    pub mean_deg: f64,
    /// Standard deviation of the beta law, degrees.
    pub sd_deg: f64,
}

impl LeafAngleLaw {
    /// Density of inclination `theta_deg` (0 = level), up to a factor.
    pub fn density(&self, theta_deg: f64) -> f64 {
        let (cos, sin) = cos_sin_deg(theta_deg);
        match self.kind {
            LeafAngle::AsInserted | LeafAngle::Spherical => sin,
            LeafAngle::Ellipsoidal => {
                let square = cos * cos + self.chi * self.chi * sin * sin;
                sin / (square * square)
            }
            LeafAngle::Beta => {
                let (mu, nu) = self.exponents();
                let t = theta_deg / 90.0;
                libm::pow(1.0 - t, mu - 1.0) * libm::pow(t, nu - 1.0)
            }
        }
    }

    /// False for a mean and a deviation that no beta law has.
    pub fn is_valid(&self) -> bool {
        let (mu, nu) = self.exponents();
        self.kind != LeafAngle::Beta || (mu > 0.0 && nu > 0.0)
    }

    /// μ and ν of the beta law from mean and deviation.
    fn exponents(&self) -> (f64, f64) {
        let t = self.mean_deg / 90.0;
        let variance = (self.sd_deg / 90.0) * (self.sd_deg / 90.0);
        let spread = t * (1.0 - t) / variance - 1.0;
        ((1.0 - t) * spread, t * spread)
    }
}

/// A law made ready to be drawn from.
#[derive(Clone, Debug)]
pub(crate) struct LeafAngles {
    /// Summed density at the upper end of every step; empty where nothing is drawn.
    sums: Vec<f64>,
}

impl LeafAngles {
    /// Sums the law up.
    pub(crate) fn of(law: LeafAngleLaw) -> Self {
        let steps = if law.kind == LeafAngle::AsInserted { 0 } else { STEPS };
        let weight = |k: u32| law.density((f64::from(k) + 0.5) * STEP_DEG);
        let sums = (0..steps).scan(0.0, |sum, k| {
            *sum += weight(k);
            Some(*sum)
        });
        Self { sums: sums.collect() }
    }

    /// Midrib and width of a blade, turned to a drawn inclination about its foot; nothing is drawn for
    /// [`LeafAngle::AsInserted`].
    pub(crate) fn turn(&self, midrib: DVec3, across: DVec3, stream: &mut Stream) -> (DVec3, DVec3) {
        let Some(total) = self.sums.last() else { return (midrib, across) };
        let wanted_deg = self.at(stream.unit() * total);
        let normal = midrib.cross(across).normalize_or_zero();
        let upper = if normal.z < 0.0 { -normal } else { normal };
        // About the level line in the blade's plane: the bearing of the normal stays.
        let level = DVec3::Z.cross(upper).try_normalize().unwrap_or(DVec3::X);
        let here_deg = libm::acos(upper.z.clamp(-1.0, 1.0)).to_degrees();
        let by = |v: DVec3| rotation::rotate(v, level, wanted_deg - here_deg);
        (by(midrib), by(across))
    }

    /// The inclination (degrees) up to which the density sums to `sum`; linear within a step.
    fn at(&self, sum: f64) -> f64 {
        let step = self.sums.partition_point(|upper| *upper <= sum);
        let before = step.checked_sub(1).and_then(|k| self.sums.get(k)).copied().unwrap_or(0.0);
        let within = self.sums.get(step).map_or(0.0, |upper| (sum - before) / (upper - before));
        (step as f64 + within) * STEP_DEG
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::Purpose;

    const DEFAULT: LeafAngleLaw =
        LeafAngleLaw { kind: LeafAngle::AsInserted, chi: 1.0, mean_deg: 45.0, sd_deg: 20.0 };

    fn drawn(kind: LeafAngle, law: LeafAngleLaw) -> Vec<f64> {
        let law = LeafAngles::of(LeafAngleLaw { kind, ..law });
        let mut stream = Purpose::Foliage.stream(3, 0, 0);
        (0..4000)
            .map(|_| {
                let (midrib, across) = law.turn(DVec3::X, DVec3::new(0.0, 0.6, 0.8), &mut stream);
                assert!(midrib.dot(across).abs() < 1e-12 && (midrib.length() - 1.0).abs() < 1e-12);
                libm::acos(midrib.cross(across).z.abs().min(1.0)).to_degrees()
            })
            .collect()
    }

    fn mean_and_sd(values: &[f64]) -> (f64, f64) {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
        (mean, (square / values.len() as f64).sqrt())
    }

    #[test]
    fn a_spherical_law_has_a_mean_of_one_radian_and_its_ellipsoid_agrees() {
        // ∫ θ sin θ over the quarter is 1.
        let (mean, _) = mean_and_sd(&drawn(LeafAngle::Spherical, DEFAULT));
        assert!((mean - 1f64.to_degrees()).abs() < 1.5, "{mean}");
        let (same, _) = mean_and_sd(&drawn(LeafAngle::Ellipsoidal, DEFAULT));
        assert!((mean - same).abs() < 1e-6);
        let flat = LeafAngleLaw { chi: 3.0, ..DEFAULT };
        assert!(mean_and_sd(&drawn(LeafAngle::Ellipsoidal, flat)).0 < mean - 15.0);
    }

    #[test]
    fn a_beta_law_has_the_mean_and_deviation_asked_for() {
        let erect = LeafAngleLaw { kind: LeafAngle::Beta, mean_deg: 60.0, sd_deg: 12.0, ..DEFAULT };
        let (mean, sd) = mean_and_sd(&drawn(LeafAngle::Beta, erect));
        assert!((mean - 60.0).abs() < 1.0 && (sd - 12.0).abs() < 0.6, "{mean} {sd}");
        assert!(erect.is_valid());
        let wild = LeafAngleLaw { mean_deg: 5.0, sd_deg: 40.0, ..erect };
        assert!(!wild.is_valid());
    }
}
