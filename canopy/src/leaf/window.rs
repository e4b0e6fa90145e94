//! The leaf area just driven past.

use super::Known;
use super::estimator::LeafAreaEstimator;
use super::law::Law;
use super::slices::{MOST, SliceLeaf};
use super::withheld::Withheld;
use crate::recent::BANDS;

/// The leaf area of the last whole slices of a row: 0.5 m of it at least, or one slice where that is longer. Like the row's, by contact frequency or by shares
/// of spots, with the factor of the row so far; so windows that do not overlap add up to the row's leaf area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafWindow {
    parts: [LeafSlice; MOST],
    count: usize,
    /// What raw leaf areas are multiplied by, of the row so far.
    factor: f64,
    row_spacing: Known,
    /// Where the leaf area comes from.
    pub estimator: LeafAreaEstimator,
    /// Metres from the end of the window to the mirror; negative where the window ends ahead of the mirror, as with a yaw.
    pub behind_m: f64,
}

/// One slice of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeafSlice {
    /// Its faces along the row, metres.
    pub y_m: [f64; 2],
    /// Metres of it that were scanned.
    pub length_m: f64,
    /// Raw leaf area by height, the lowest band first, m²: no fitted factor, wood included.
    pub raw_m2: [f64; BANDS],
}

impl LeafWindow {
    /// Of these slices, the latest first, of which the row's latest line is at `line_y_m`, and the mirror at `mirror_y_m`.
    ///
    /// # Errors
    /// Why the row's leaf area is withheld.
    pub(crate) fn of(
        law: &Law<'_>,
        slices: impl Iterator<Item = SliceLeaf>,
        line_y_m: f64,
        mirror_y_m: f64,
    ) -> Result<Self, Withheld> {
        let factor = law.factor()?;
        let count_by = law.counted().count;
        let mut parts = [LeafSlice::default(); MOST];
        let mut count = 0;
        for (part, slice) in parts.iter_mut().zip(slices) {
            let raw_m2 = count_by.of(slice.contact_m2, slice.share_m2);
            *part = LeafSlice { y_m: slice.y_m, length_m: slice.length_m, raw_m2 };
            count += 1;
        }
        let [latest, ..] = parts;
        // A slice that is still open ends with the latest line.
        let behind_m = mirror_y_m - latest.y_m[1].min(line_y_m);
        let (row_spacing, estimator) = (law.ground_width_m(), law.estimator());
        let window = Self { parts, count, factor, row_spacing, estimator, behind_m };
        if window.length_m() > 0.0 { Ok(window) } else { Err(Withheld::NotScanned) }
    }

    /// Its slices, the latest first.
    pub fn slices(&self) -> &[LeafSlice] {
        self.parts.get(..self.count).unwrap_or_default()
    }

    /// What raw leaf areas are multiplied by, of the row so far.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Metres of row scanned in it.
    pub fn length_m(&self) -> f64 {
        self.slices().iter().map(|slice| slice.length_m).sum()
    }

    /// One-sided leaf area a metre of row by height, the lowest band first, m²/m.
    pub fn bands_m2_per_m(&self) -> [f64; BANDS] {
        let mut bands = [0.0; BANDS];
        for slice in self.slices() {
            for (band, raw_m2) in bands.iter_mut().zip(slice.raw_m2) {
                *band += raw_m2;
            }
        }
        bands.map(|raw_m2| self.factor * raw_m2 / self.length_m())
    }

    /// One-sided leaf area a metre of row, m²/m.
    pub fn m2_per_m(&self) -> f64 {
        self.bands_m2_per_m().iter().sum()
    }

    /// Leaf area index.
    ///
    /// # Errors
    /// The rig knows no row spacing, or no tree spacing.
    pub fn lai(&self) -> Known {
        self.row_spacing.map(|spacing_m| self.m2_per_m() / spacing_m)
    }
}

impl LeafSlice {
    /// Raw leaf area of all bands, m².
    pub fn raw_m2(&self) -> f64 {
        self.raw_m2.iter().sum()
    }
}
