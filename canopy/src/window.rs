//! The canopy just driven past: what a sprayer needs now, not at the end of the row.

use crate::leaf::{LeafWindow, Withheld};
use crate::recent::WindowSums;

pub use crate::recent::{BAND_M, BANDS};

/// A stretch of canopy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Metres of row scanned in it.
    pub length_m: f64,
    /// Impacted area by height, the lowest band first, m².
    pub bands_m2: [f64; BANDS],
    /// Highest canopy return, metres above the ground; `None` without any.
    pub height_m: Option<f64>,
    /// Volume between the outline of the side seen and the row axis, m³.
    pub volume_m3: f64,
    /// The leaf area of the last whole slices, or why it is not told.
    pub leaf: Result<LeafWindow, Withheld>,
}

impl Default for Window {
    fn default() -> Self {
        let leaf = Err(Withheld::NotScanned);
        Self { length_m: 0.0, bands_m2: [0.0; BANDS], height_m: None, volume_m3: 0.0, leaf }
    }
}

impl Window {
    /// Impacted area of all bands, m².
    pub fn impacted_m2(&self) -> f64 {
        self.bands_m2.iter().sum()
    }

    /// A quantity per metre of row; `None` where no row was scanned.
    pub fn per_metre(&self, quantity: f64) -> Option<f64> {
        (self.length_m > 0.0).then(|| quantity / self.length_m)
    }

    /// Of these sums, with this leaf area.
    pub(crate) fn of(sums: WindowSums, leaf: Result<LeafWindow, Withheld>) -> Self {
        let WindowSums { length_m, bands_m2, height_m, volume_m3 } = sums;
        Self { length_m, bands_m2, height_m, volume_m3, leaf }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_scanned_is_no_zero() {
        assert_eq!(Window::default().per_metre(0.0), None);
    }
}
