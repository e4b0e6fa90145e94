//! The leaf areas of a stretch of row.

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

use super::withheld::Withheld;

/// A number, or why it is not told.
pub type Known = Result<f64, Withheld>;

/// One-sided leaf areas of a stretch of row by every way that a row is measured, m².
///
/// Serialises as `leaf_area_m2`, `leaf_area_contact_m2`, `leaf_area_regression_m2` and `lai`, null where withheld.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafAreas {
    pub(super) best: Known,
    pub(super) contact: Known,
    pub(super) contact_raw: Known,
    pub(super) share: Known,
    pub(super) share_raw: Known,
    pub(super) regression: Known,
    /// Ground that the stretch stands on, m².
    pub(super) ground: Known,
}

impl LeafAreas {
    /// All of them withheld.
    pub fn withheld(why: Withheld) -> Self {
        let none = Err(why);
        Self {
            best: none,
            contact: none,
            contact_raw: none,
            share: none,
            share_raw: none,
            regression: none,
            ground: none,
        }
    }

    /// The same with another best one.
    pub(crate) fn with_best(self, leaf_m2: f64) -> Self {
        Self { best: Ok(leaf_m2), ..self }
    }

    /// The same with what was met by contact.
    pub(super) fn with_raw(self, contact_m2: f64) -> Self {
        Self { contact_raw: Ok(contact_m2), ..self }
    }

    /// What the leaf area is: by shares of spots where the row is measured by them, else by contact frequency.
    ///
    /// # Errors
    /// Why it is withheld; so of all below.
    pub fn best_m2(&self) -> Known {
        self.best
    }

    /// By contact frequency, scaled if a calibration says how.
    pub fn contact_m2(&self) -> Known {
        self.contact
    }

    /// By contact frequency, no fitted factor, wood included.
    pub fn contact_raw_m2(&self) -> Known {
        self.contact_raw
    }

    /// By the shares of spots that remission tells, scaled by the calibration.
    pub fn share_m2(&self) -> Known {
        self.share
    }

    /// By the shares of spots, no fitted factor, wood included.
    pub fn share_raw_m2(&self) -> Known {
        self.share_raw
    }

    /// By the calibration's regression on I_T.
    pub fn regression_m2(&self) -> Known {
        self.regression
    }

    /// Leaf area index: [`Self::best_m2`] over the ground that the stretch stands on.
    pub fn lai(&self) -> Known {
        let (leaf_m2, ground_m2) = (self.best?, self.ground?);
        if ground_m2 > 0.0 { Ok(leaf_m2 / ground_m2) } else { Err(Withheld::NotScanned) }
    }
}

impl Default for LeafAreas {
    /// Nothing is known.
    fn default() -> Self {
        Self::withheld(Withheld::NothingValid)
    }
}

impl Serialize for LeafAreas {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(4))?;
        map.serialize_entry("leaf_area_m2", &self.best.ok())?;
        map.serialize_entry("leaf_area_contact_m2", &self.contact.ok())?;
        map.serialize_entry("leaf_area_regression_m2", &self.regression.ok())?;
        map.serialize_entry("lai", &self.lai().ok())?;
        map.end()
    }
}
