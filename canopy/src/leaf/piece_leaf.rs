//! The leaf area of a piece of a row: a tree or a metre.

use serde::{Serialize, Serializer};

use super::areas::{Known, LeafAreas};
use super::withheld::Withheld;

/// The leaf area of a tree or a metre. The best one is drawn toward the row's mean as far as the piece's own measurement is uncertain (`pieces`
/// of the estimate says how far); all others are as measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PieceLeaf {
    /// The areas, each known or withheld.
    pub areas: LeafAreas,
    /// What [`LeafAreas::best_m2`] was before it was drawn toward the row's mean, m².
    pub unshrunk: Known,
    /// The ends within which the piece's leaf area lies with 95 %, m². `None` where the row has no interval.
    pub interval_m2: Option<[f64; 2]>,
    /// The same by the row's own sampling and the piece's error alone, m².
    pub sampling_error_m2: Option<[f64; 2]>,
}

impl PieceLeaf {
    /// As measured.
    pub(crate) fn measured(areas: LeafAreas) -> Self {
        Self { areas, unshrunk: areas.best_m2(), interval_m2: None, sampling_error_m2: None }
    }
}

impl Default for PieceLeaf {
    /// Nothing is known.
    fn default() -> Self {
        Self::measured(LeafAreas::withheld(Withheld::NothingValid))
    }
}

/// The keys of a piece's leaf area, in their order in files.
#[derive(Serialize)]
struct Keys<'a> {
    #[serde(flatten)]
    areas: &'a LeafAreas,
    leaf_area_unshrunk_m2: Option<f64>,
    leaf_area_interval_m2: Option<[f64; 2]>,
    leaf_area_sampling_error_m2: Option<[f64; 2]>,
}

impl Serialize for PieceLeaf {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Keys {
            areas: &self.areas,
            leaf_area_unshrunk_m2: self.unshrunk.ok(),
            leaf_area_interval_m2: self.interval_m2,
            leaf_area_sampling_error_m2: self.sampling_error_m2,
        }
        .serialize(serializer)
    }
}
