//! What hits are counted by, and the scale that makes leaf area of it.

use super::count::Count;
use super::sums::Sums;
use super::withheld::Withheld;
use crate::calibration::{Calibration, ContactScale};
use crate::class::ClassKey;
use crate::remission::CardDoubt;
use crate::row::{Row, Totals};

/// Of so many hits at least, remission must be known.
const READ: f64 = 0.95;

/// A row's raw leaf area, what it was counted by, and its scale.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counted<'a> {
    pub(crate) count: Count,
    /// What raw leaf areas are multiplied by before the scale: how the row's leaves stand, for hits of beams with a width.
    pub(crate) clumping: f64,
    /// The row's raw leaf area times that: as rays would have it, as well as is known.
    pub(crate) raw_m2: f64,
    pub(crate) scale: Option<&'a ContactScale>,
    /// What it is multiplied by then: the row's own factor, for its trees, metres and windows too. So they add up to the row, and the exponent does not
    /// enlarge their scatter.
    pub(crate) factor: f64,
}

impl<'a> Counted<'a> {
    fn new(
        count: Count,
        (sum_m2, clumping): (f64, f64),
        canopy_m: f64,
        scale: Option<&'a ContactScale>,
    ) -> Self {
        let raw_m2 = clumping * sum_m2;
        let factor = scale.map_or(1.0, |scale| scale.factor(raw_m2 / canopy_m));
        Self { count, clumping, raw_m2, scale, factor }
    }

    /// By hits, of leaves that stand like this.
    pub(super) fn by_hits(totals: &Totals, clumping: f64, calibration: Option<&'a Calibration>) -> Self {
        let scale = calibration.map(|c| &c.contact);
        Self::new(Count::Hits, (totals.contact_m2, clumping), totals.canopy_m, scale)
    }

    /// The same of a stretch of the row, m².
    pub(super) fn raw_of(&self, sums: &Sums) -> f64 {
        self.clumping * self.count.of(sums.contact_m2, sums.share_m2)
    }

    /// By shares of spots, where the remission of nearly all hits is read, the calibration knows what to make of it from there (leaves share a wider spot
    /// otherwise), and contact bears witness.
    ///
    /// # Errors
    /// Why not by them.
    pub(super) fn by_shares(
        row: &Row,
        totals: &Totals,
        contact: &Counted<'_>,
        calibration: Option<&'a Calibration>,
    ) -> Result<Self, Withheld> {
        let scale = row.remission().filter(|_| reads_remission(row, totals)).ok_or(Withheld::NoShares)?;
        let calibration = calibration.ok_or(Withheld::NoShares)?;
        let fitted_m = calibration.class.distance_m.ok_or(Withheld::NoShares)?;
        if !ClassKey::Distance.is_same(fitted_m, row.frame().distance_m) {
            return Err(Withheld::NoShares);
        }
        let share = calibration.share.as_ref().ok_or(Withheld::NoShares)?;
        match scale.doubt {
            Some(CardDoubt::TooShort) => return Err(Withheld::CardTooShort),
            Some(CardDoubt::OtherLaw(_)) => return Err(Withheld::CardLaw),
            None => {}
        }
        let (ratio, [low, high]) =
            shares_over_contact(calibration, contact, &Sums::from(totals)).ok_or(Withheld::NoWitness)?;
        // Before the first hit there is nothing to disagree about.
        if contact.raw_m2 > 0.0 && !(low..=high).contains(&ratio) {
            return Err(Withheld::SharesDisagree);
        }
        Ok(Self::new(Count::Shares, (totals.share_m2, 1.0), totals.canopy_m, Some(share)))
    }
}

/// What a row's shares say over what its contact says, both raw, and what 99 of 100 rows of the calibration have. `None` where the calibration says nothing of it.
pub(crate) fn shares_over_contact(
    calibration: &Calibration,
    contact: &Counted<'_>,
    row: &Sums,
) -> Option<(f64, [f64; 2])> {
    let band = calibration.witness?.band(&calibration.contact, contact.raw_m2 / row.length_m, row.length_m);
    Some((row.share_m2 / contact.raw_m2, band))
}

/// Whether remission is read, and nearly all hits have it.
pub(crate) fn reads_remission(row: &Row, totals: &Totals) -> bool {
    row.remission().is_some() && totals.shares as f64 >= READ * totals.hits as f64
}
