//! Wood that beams meet among the leaves.

use serde::{Deserialize, Serialize};

/// Below this share of leaf in what was met, no leaf area is told: how leaves stand is known to 13 % of what was met, which would be a third of the leaves.
pub(crate) const LEAST_LEAF: f64 = 0.4;

/// What a spot makes of wood beside rays: thin branches fill a part of it, and are counted as wider than they are. Of bare rows, docs/optics.md.
pub(super) const WOOD_BY_SPOT: f64 = 1.48;

/// Half of the surface of the wood that beams meet, as contact counts it: one-sided leaf area is half of a leaf's surface, too. It is the leaf area that contact
/// tells of a row without leaves.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wood {
    /// Mean of the fitted rows a metre of canopy, m²/m.
    pub m2_per_m: f64,
    /// Standard deviation between rows, m²/m.
    pub sd_m2_per_m: f64,
}

/// The share of a raw leaf area of so many m² a metre that is no wood, where rows of its kind have so much wood; 1 of nothing.
pub(super) fn leafy_share(wood_m2_per_m: f64, raw_m2_per_m: f64) -> f64 {
    if raw_m2_per_m > 0.0 { (raw_m2_per_m - wood_m2_per_m).max(0.0) / raw_m2_per_m } else { 1.0 }
}

impl Wood {
    /// Of the surfaces of the wood of several rows a metre, m²/m; `None` of fewer than two.
    pub(super) fn of(surfaces_m2_per_m: &[f64]) -> Option<Self> {
        let count = surfaces_m2_per_m.len();
        if count < 2 {
            return None;
        }
        let m2_per_m = crate::regression::mean(surfaces_m2_per_m) / 2.0;
        let squares: f64 = surfaces_m2_per_m.iter().map(|surface| (surface / 2.0 - m2_per_m).powi(2)).sum();
        Some(Self { m2_per_m, sd_m2_per_m: (squares / (count - 1) as f64).sqrt() })
    }
}
