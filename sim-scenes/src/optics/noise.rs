//! Noise: white, fixed pattern over the beams, and a unit's systematic error over range.

use rowscan_protocol::optics::{Noise, NoiseShape, Optics};

use super::draws::{Draws, Use};
use super::settings::NoiseLevel;

/// Nearer than this a device may scatter less, metres.
const NEAR_M: f64 = 0.5;

/// Half width of the uniform part and sigma of the normal part of [`NoiseShape::Flat`], mm \[REC\].
const FLAT: (f64, f64) = (12.0, 4.4);

/// Where a unit's systematic error is drawn, metres; between them it changes smoothly.
const KNOTS_M: [f64; 6] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0];

/// Incidences beyond this scatter no more: tan 80°.
const STEEPEST: f64 = 5.7;

/// The errors of one unit.
#[derive(Clone, Debug)]
pub(super) struct UnitNoise {
    facts: Noise,
    sigma_mm: f64,
    near_sigma_mm: f64,
    /// By beam, mm.
    pattern_mm: Vec<f64>,
    /// At [`KNOTS_M`], mm.
    curve_mm: [f64; KNOTS_M.len()],
}

impl UnitNoise {
    /// The unit with this seed, for so many beams.
    pub(super) fn new(optics: &Optics, level: NoiseLevel, unit: u64, beams: usize) -> Self {
        let facts = optics.noise;
        let pattern = Draws::of(unit, Use::Pattern, 0);
        let pattern_mm = (0..beams).map(|beam| pattern.beam(beam).normal() * facts.pattern_mm.value);
        let curve = Draws::of(unit, Use::Curve, 0);
        let half_mm = facts.systematic_mm.value / 2.0;
        let (sigma_mm, near_sigma_mm) = match level {
            NoiseLevel::Recorded => (facts.sigma_mm.value, facts.near_sigma_mm.value),
            NoiseLevel::Sheet => (facts.sheet_sigma_mm.value, facts.sheet_sigma_mm.value),
        };
        Self {
            facts,
            sigma_mm,
            near_sigma_mm,
            pattern_mm: pattern_mm.collect(),
            curve_mm: std::array::from_fn(|knot| half_mm * (2.0 * curve.beam(knot).unit() - 1.0)),
        }
    }

    /// Error of a range that stands still: fixed pattern and systematic error, mm.
    pub(super) fn fixed_mm(&self, beam: usize, range_m: f64) -> f64 {
        self.pattern_mm.get(beam).copied().unwrap_or_default() + self.systematic_mm(range_m)
    }

    fn systematic_mm(&self, range_m: f64) -> f64 {
        let octave = libm::log2(range_m.max(1e-3) / KNOTS_M[0]).clamp(0.0, (KNOTS_M.len() - 1) as f64);
        let knot = (octave as usize).min(KNOTS_M.len() - 2);
        let part = octave - knot as f64;
        let smooth = part * part * (3.0 - 2.0 * part);
        let [near, far] = [knot, knot + 1].map(|knot| self.curve_mm.get(knot).copied().unwrap_or_default());
        near + smooth * (far - near)
    }

    /// Scatter of a range, one standard deviation, mm. `weakness` is the least power that is detected over the echo's.
    pub(super) fn sigma_mm(&self, range_m: f64, cos_incidence: f64, weakness: f64) -> f64 {
        let base = if range_m < NEAR_M { self.near_sigma_mm } else { self.sigma_mm };
        let weak = self.facts.weak_sigma_mm.value;
        let tan =
            ((1.0 - cos_incidence * cos_incidence).max(0.0).sqrt() / cos_incidence.max(1e-6)).min(STEEPEST);
        let slant = self.facts.slant_mrad.value * range_m * tan;
        (base * base + weak * weak * weakness.min(1.0) + slant * slant).sqrt()
    }

    /// A number with mean 0 and variance 1, as values of this model scatter.
    pub(super) fn draw(&self, draws: &mut Draws) -> f64 {
        match self.facts.shape {
            NoiseShape::Normal => draws.normal(),
            NoiseShape::Flat => {
                let (half, normal) = FLAT;
                let value = half * (2.0 * draws.unit() - 1.0) + normal * draws.normal();
                value / (half * half / 3.0 + normal * normal).sqrt()
            }
        }
    }
}
