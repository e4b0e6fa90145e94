//! Random numbers of the eye: keyed by seed, stage, scanner, scan and beam, so that none depends on the order of work.
//!
//! A line takes millions of them, so a beam's numbers are SplitMix64's from a state that the key gives, not a stream of its own.

use rowscan_protocol::random::mix;

use super::normal;

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// What numbers are for. Part of the scene format, as [`crate::seed::Purpose`] is.
#[derive(Clone, Copy, Debug)]
#[repr(u64)]
pub(super) enum Use {
    /// Place of the plane grid of a line.
    Phase = 101,
    /// Soft threshold.
    Threshold = 102,
    /// White noise.
    White = 103,
    /// A unit's fixed pattern.
    Pattern = 104,
    /// A unit's systematic error.
    Curve = 105,
    /// Scatter of the remission.
    Remission = 106,
    /// Drops and flakes.
    Drops = 107,
    /// Gusts of dust.
    Gust = 108,
    /// Place of a layer's echo.
    Layer = 109,
    /// Concentration of a plume.
    Spray = 110,
    /// Drops on the window.
    WindowDrop = 111,
    /// Shots that the sun dazzles.
    Sun = 112,
    /// Bend of a unit's scan plane.
    Bend = 113,
}

/// Numbers of one key.
#[derive(Clone, Copy, Debug)]
pub(super) struct Draws(u64);

impl Draws {
    /// The numbers of one use and line; a key of the scan, such as its time.
    pub(super) fn of(seed: u64, purpose: Use, scan: u64) -> Self {
        let fold = |state: u64, word: u64| mix(state ^ word.wrapping_mul(GOLDEN));
        Self(fold(fold(mix(seed), purpose as u64), scan))
    }

    /// The same for one beam.
    pub(super) fn beam(self, beam: usize) -> Self {
        Self(mix(self.0 ^ (beam as u64).wrapping_mul(GOLDEN)))
    }

    /// The same for one echo of the beam.
    pub(super) fn echo(self, number: usize) -> Self {
        Self(mix(self.0 ^ (number as u64 + 1).wrapping_mul(GOLDEN)))
    }

    fn next(&mut self) -> u64 {
        let value = mix(self.0);
        self.0 = self.0.wrapping_add(GOLDEN);
        value
    }

    /// Uniform in [0, 1).
    pub(super) fn unit(&mut self) -> f64 {
        normal::unit(self.next())
    }

    /// Standard normal.
    pub(super) fn normal(&mut self) -> f64 {
        normal::normal(|| self.next())
    }
}

/// The numbers of one line that every beam takes.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineDraws {
    pub(super) threshold: Draws,
    pub(super) white: Draws,
    pub(super) remission: Draws,
    pub(super) sun: Draws,
}

impl LineDraws {
    pub(super) fn of(seed: u64, scan: u64) -> Self {
        let of = |purpose| Draws::of(seed, purpose, scan);
        Self {
            threshold: of(Use::Threshold),
            white: of(Use::White),
            remission: of(Use::Remission),
            sun: of(Use::Sun),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_have_the_moments_of_a_normal() {
        let n = 40_000;
        let values = (0..n).map(|beam| Draws::of(7, Use::White, 3).beam(beam).normal());
        let (mut two, mut four) = (0.0, 0.0);
        values.for_each(|value| (two, four) = (two + value * value, four + value.powi(4)));
        let (variance, kurtosis) = (two / n as f64, four * n as f64 / (two * two));
        // Four standard errors.
        assert!((variance - 1.0).abs() < 0.03, "{variance}");
        assert!((kurtosis - 3.0).abs() < 0.1, "{kurtosis}");
    }

    #[test]
    fn every_part_of_the_key_matters() {
        let first = |seed, purpose, scan, beam| Draws::of(seed, purpose, scan).beam(beam).unit().to_bits();
        let all = [
            first(1, Use::White, 0, 0),
            first(2, Use::White, 0, 0),
            first(1, Use::Phase, 0, 0),
            first(1, Use::White, 1, 0),
            first(1, Use::White, 0, 1),
            first(1, Use::White, 1, 1),
        ];
        assert!((0..all.len()).all(|i| all.iter().skip(i + 1).all(|other| all.get(i) != Some(other))));
    }
}
