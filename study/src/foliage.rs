//! Rows of one class that carry more or less leaf.

use std::fmt;
use std::str::FromStr;

use rowscan_protocol::random::Stream;
use rowscan_scenes::Scene;

/// First word of this draw's random key; the scene's own draws have numbers below.
const FOLIAGE: u64 = 1001;

/// The leaf area indices that rows are dressed to, uniform over the range. A trained orchard's own rows are so alike that a line through them has no
/// slope to speak of; between orchards of one training system the index differs by a factor of two and more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaiRange {
    low: f64,
    high: f64,
}

impl LaiRange {
    /// The scene's row of this seed, with the leaf area index that the seed draws.
    pub fn dress(self, scene: &Scene, seed: u64) -> Scene {
        let share = Stream::keyed(seed, &[FOLIAGE]).unit();
        let mut scene = Scene { seed, ..scene.clone() };
        scene.orchard.target_lai = Some(self.low + share * (self.high - self.low));
        scene
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
    fn a_range_is_two_indices_in_order() {
        for text in ["", "1", "2..1", "0..1", "1..x", "1..101", "-1..2"] {
            assert!(text.parse::<LaiRange>().expect_err(text).contains("LOW..HIGH"), "{text}");
        }
    }
}
