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

    /// Whether it is of the outline of the canopy: where it lies, and how high and wide it is.
    fn is_of_outline(self) -> bool {
        matches!(
            self,
            Self::Height
                | Self::MedianHeight
                | Self::Base
                | Self::Width
                | Self::MedianWidth
                | Self::Volume
                | Self::TreeRowVolume
                | Self::LeafWallArea
        )
    }

    /// Whether it is not told where leaf areas are withheld for this.
    pub fn falls_with(self, why: Withheld) -> bool {
        // What counts as canopy is something else as well, or does not lie where the rig has it.
        let is_other = matches!(
            why,
            Withheld::GroundAsCanopy
                | Withheld::GroundLevel
                | Withheld::GroundSlope
                | Withheld::InTheAir
                | Withheld::RidesAlong
                | Withheld::RowElsewhere
        );
        self.is_of_leaves()
            || (self == Self::TreeAreaIndex && why != Withheld::MostlyWood)
            || (self.is_of_outline() && is_other)
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

    /// The same where leaf areas are told, or are not: then what is of leaves has no value, nor what falls with the reason.
    #[must_use]
    pub(crate) fn told(self, leaves: Result<(), Withheld>) -> Self {
        match leaves {
            Err(why) if self.quantity.falls_with(why) => Self { value: None, low: None, high: None, ..self },
            _ => self,
        }
    }

    /// The height band, if it is of one.
    pub fn band_m(&self) -> Option<[f64; 2]> {
        Some([self.z_from_m?, self.z_to_m?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is told of a row whose leaf areas are withheld for any reason: what was met, and an outline where it is the canopy's.
    #[test]
    fn what_falls_with_leaf_areas_does_so_for_its_reason() {
        for why in Withheld::ALL.iter().copied() {
            let is_told = |quantity| Measure::new("any", quantity, Some(1.0)).told(Err(why)).value.is_some();
            let fallen: Vec<_> =
                Quantity::ALL.iter().copied().filter(|quantity| !is_told(*quantity)).collect();
            for quantity in Quantity::ALL.iter().copied() {
                assert!(Measure::new("any", quantity, Some(1.0)).told(Ok(())).value.is_some());
                assert!(!(quantity.is_of_leaves() && is_told(quantity)), "{why}: {quantity:?}");
            }
            for met in [Quantity::ImpactedArea, Quantity::GapFraction, Quantity::Occluded] {
                assert!(is_told(met), "{why}: {met:?}");
            }
            // An index of leaves and wood stands where all is wood; the outline falls as a whole or not at all.
            assert_eq!(is_told(Quantity::TreeAreaIndex), why == Withheld::MostlyWood, "{why}");
            let outline = fallen.iter().filter(|quantity| quantity.is_of_outline()).count();
            assert!([0, 8].contains(&outline), "{why}: {fallen:?}");
        }
        for (why, stands) in
            [(Withheld::NoFoliage, true), (Withheld::GroundAsCanopy, false), (Withheld::InTheAir, false)]
        {
            let height = Measure::new("height", Quantity::Height, Some(4.0)).told(Err(why));
            assert_eq!(height.value.is_some(), stands, "{why}");
        }
    }
}
