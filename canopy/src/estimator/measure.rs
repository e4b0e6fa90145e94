//! What an estimator reports.

use serde::{Deserialize, Serialize};

use crate::leaf::Withheld;

/// Declares the quantities once: variant, key with unit, what it is.
macro_rules! quantities {
    ($( $variant:ident = $key:literal, $meaning:literal; )+) => {
        /// What a measure is of. Keys carry units.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum Quantity {
            $( #[doc = $meaning] #[serde(rename = $key)] $variant, )+
        }

        impl Quantity {
            /// All of them.
            pub const ALL: &'static [Self] = &[$( Self::$variant, )+];

            /// Its key in files, with the unit.
            pub fn key(self) -> &'static str {
                match self { $( Self::$variant => $key, )+ }
            }

            /// What it is.
            pub fn meaning(self) -> &'static str {
                match self { $( Self::$variant => $meaning, )+ }
            }
        }
    };
}

quantities! {
    LeafArea = "leaf_area_m2", "One-sided leaf area, m²; wood counts as leaf.";
    Lai = "lai", "One-sided leaf area over row spacing × metres scanned.";
    LeafAreaDensity = "leaf_area_density_m2_m3", "Mean leaf area density of the voxels that hold leaves, m²/m³.";
    TreeAreaIndex = "tree_area_index", "Area projected on the beams over ground area: G = 1.";
    ImpactedArea = "impacted_total_area_m2", "Impacted area of all canopy returns, leaf and wood, m².";
    GapFraction = "row_plane_gap_fraction", "Share of the beams aimed at a height band of the row plane that nothing stops, before the plane or behind it: below 1 above a crown that rising beams pass through.";
    Porosity = "porosity", "Share of the beams through the crown, from base to top, that it lets pass.";
    Height = "height_m", "Height that 99.5 % of the canopy returns stay below, metres.";
    MedianHeight = "height_p50_m", "Median height of the canopy returns, metres.";
    Base = "height_p1_m", "Height that 1 % of the canopy returns stay below, metres.";
    Width = "width_m", "Twice the half width that 99.5 % of the returns before the row plane stay within, metres.";
    MedianWidth = "width_p50_m", "Twice the median half width of the returns before the row plane, metres.";
    Volume = "volume_m3", "Volume from the outermost returns to the row plane, doubled, m³.";
    TreeRowVolume = "tree_row_volume_m3_ha", "Tree row volume: height × width over row spacing, m³/ha.";
    LeafWallArea = "leaf_wall_area_m2_ha", "Leaf wall area, both faces, over ground area, m²/ha.";
    Occluded = "occluded_share", "Share of the voxels that beams are aimed at and too few reached.";
    NeverVisited = "never_visited_share", "Share of the voxels that no beam leads to.";
    Saturated = "saturated_share", "Share of the entered cells in which every beam ended.";
    HitsPerPatch = "hits_per_patch", "Beams that end on one patch of surface: what intervals are widened by.";
}

impl Quantity {
    /// Whether it is a leaf area, or made of one.
    pub fn is_of_leaves(self) -> bool {
        matches!(self, Self::LeafArea | Self::Lai | Self::LeafAreaDensity)
    }
}

/// One number of one estimator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measure {
    /// The estimator's name.
    pub estimator: &'static str,
    /// What it is.
    pub quantity: Quantity,
    /// Lower end of the height band, metres; null for the whole height.
    pub z_from_m: Option<f64>,
    /// Upper end of the height band, metres.
    pub z_to_m: Option<f64>,
    /// The number; null where nothing can be said.
    pub value: Option<f64>,
    /// Lower end of the sampling error, 95 %, where the literature has one: not what classes differ by.
    #[serde(rename = "sampling_low")]
    pub low: Option<f64>,
    /// Upper end of the sampling error.
    #[serde(rename = "sampling_high")]
    pub high: Option<f64>,
}

impl Measure {
    /// A number over the whole height, without an interval.
    pub fn new(estimator: &'static str, quantity: Quantity, value: Option<f64>) -> Self {
        let value = value.filter(|value| value.is_finite());
        Self { estimator, quantity, z_from_m: None, z_to_m: None, value, low: None, high: None }
    }

    /// The same with its sampling error, 95 %.
    #[must_use]
    pub(crate) fn within(self, [low, high]: [f64; 2]) -> Self {
        let known = self.value.is_some() && low.is_finite() && high.is_finite();
        Self { low: known.then_some(low), high: known.then_some(high), ..self }
    }

    /// The same for a height band.
    #[must_use]
    pub(crate) fn of_band(self, [from_m, to_m]: [f64; 2]) -> Self {
        Self { z_from_m: Some(from_m), z_to_m: Some(to_m), ..self }
    }

    /// The same where leaf areas are told, or are not: then what is of leaves has no value.
    #[must_use]
    pub(crate) fn told(self, leaves: Result<(), Withheld>) -> Self {
        match leaves {
            Err(_) if self.quantity.is_of_leaves() => Self { value: None, low: None, high: None, ..self },
            _ => self,
        }
    }

    /// The height band, if it is of one.
    pub fn band_m(&self) -> Option<[f64; 2]> {
        Some([self.z_from_m?, self.z_to_m?])
    }
}
