//! Rows of one class that carry more or less leaf.

use std::fmt;
use std::str::FromStr;

use rowscan_protocol::random::Stream;
use rowscan_scenes::Scene;

/// First word of this draw's random key; the scene's own draws have numbers below.
const FOLIAGE: u64 = 1001;

/// Share of a range that the drawn indices may leave empty at its ends.
const MOST_LEFT: f64 = 0.25;

/// The leaf area indices that rows are dressed to, uniform over the range. A trained orchard's own rows are so alike that a line through them has no
/// slope to speak of; between orchards of one training system the index differs by a factor of two and more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaiRange {
    low: f64,
    high: f64,
}

impl LaiRange {
    /// The leaf area index that this seed draws.
    pub fn drawn(self, seed: u64) -> f64 {
        self.low + Stream::keyed(seed, &[FOLIAGE]).unit() * (self.high - self.low)
    }

    /// The scene's row of this seed, with the leaf area index that the seed draws.
    pub fn dress(self, scene: &Scene, seed: u64) -> Scene {
        let mut scene = Scene { seed, ..scene.clone() };
        scene.orchard.target_lai = Some(self.drawn(seed));
        scene
    }

    /// The lowest and highest index that these seeds draw, where they leave more than a quarter of the range empty: a law fitted on them would stand
    /// for a range that has no row. Seeds draw independently, so few of them can lie close together.
    pub fn narrowed_to(self, seeds: &[u64]) -> Option<(f64, f64)> {
        let (low, high) = seeds
            .iter()
            .map(|seed| self.drawn(*seed))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), lai| (low.min(lai), high.max(lai)));
        (high >= low && high - low < (1.0 - MOST_LEFT) * (self.high - self.low)).then_some((low, high))
    }
}

impl fmt::Display for LaiRange {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}..{}", self.low, self.high)
    }
}

impl FromStr for LaiRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refuse = || format!("expected leaf area indices as LOW..HIGH, such as 0.8..2.4, found `{text}`");
        let (low, high) = text.split_once("..").ok_or_else(refuse)?;
        let index = |text: &str| text.parse::<f64>().ok().filter(|lai| *lai > 0.0 && *lai <= 100.0);
        let (low, high) = index(low).zip(index(high)).ok_or_else(refuse)?;
        if low <= high { Ok(Self { low, high }) } else { Err(refuse()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_spread_over_the_range_and_repeat() {
        let range: LaiRange = "0.5..2.5".parse().expect("a range");
        assert_eq!(range.to_string(), "0.5..2.5");
        let scene = rowscan_scenes::files::load_scene("spindle", |_| {}).expect("built in");
        let drawn = |seed| range.dress(&scene, seed).orchard.target_lai.expect("an index");
        let all: Vec<f64> = (1..=400).map(drawn).collect();
        assert!(all.iter().all(|lai| (0.5..2.5).contains(lai)));
        let mean = all.iter().sum::<f64>() / 400.0;
        // Four standard errors of a uniform draw's mean.
        assert!((mean - 1.5).abs() < 4.0 * 2.0 / 12_f64.sqrt() / 20.0, "{mean}");
        assert_eq!(drawn(7), drawn(7));
        assert_eq!(range.dress(&scene, 7).seed, 7);
    }

    #[test]
    fn seeds_that_leave_the_range_empty_are_named() {
        let range: LaiRange = "0.8..2.6".parse().expect("a range");
        let all: Vec<u64> = (1..=9).collect();
        let (low, high) = range.narrowed_to(&all).expect("nine seeds that draw alike");
        let lais: Vec<f64> = all.iter().map(|seed| range.drawn(*seed)).collect();
        assert!(lais.iter().all(|lai| (low..=high).contains(lai)), "{lais:?} in {low} to {high}");
        assert!(high - low < 0.3, "{low} to {high}");
        assert_eq!(range.narrowed_to(&(1001..=1060).collect::<Vec<u64>>()), None);
        assert_eq!(range.narrowed_to(&[]), None);
        assert_eq!(range.narrowed_to(&[5]), Some((range.drawn(5), range.drawn(5))));
        // A range of one index is covered by whatever draws it.
        let one: LaiRange = "2..2".parse().expect("a range");
        assert_eq!(one.narrowed_to(&all), None);
    }

    #[test]
    fn a_range_is_two_indices_in_order() {
        for text in ["", "1", "2..1", "0..1", "1..x", "1..101", "-1..2"] {
            assert!(text.parse::<LaiRange>().expect_err(text).contains("LOW..HIGH"), "{text}");
        }
    }
}
