//! What was measured of a stretch of row.

use crate::row::Totals;
use crate::trees::Cell;

/// What was measured of a stretch of row.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sums {
    /// Metres that regressions count.
    pub(crate) length_m: f64,
    pub(crate) impacted_m2: f64,
    pub(crate) contact_m2: f64,
    /// By the shares of spots.
    pub(crate) share_m2: f64,
    /// Canopy returns.
    pub(crate) returns: u64,
}

impl From<&Cell> for Sums {
    fn from(cell: &Cell) -> Self {
        Self {
            length_m: cell.scanned_m,
            impacted_m2: cell.impacted_m2,
            contact_m2: cell.contact_m2,
            share_m2: cell.share_m2,
            returns: cell.returns,
        }
    }
}

impl From<&Totals> for Sums {
    fn from(totals: &Totals) -> Self {
        Self {
            length_m: totals.canopy_m,
            impacted_m2: totals.impacted_m2,
            contact_m2: totals.contact_m2,
            share_m2: totals.share_m2,
            returns: totals.returns.canopy,
        }
    }
}
