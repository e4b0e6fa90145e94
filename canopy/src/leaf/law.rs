//! From sums to leaf areas, by one calibration and with one verdict.

use super::areas::{Known, LeafAreas};
use super::by_outline;
use super::counted::{Counted, reads_remission, shares_over_contact};
use super::estimator::LeafAreaEstimator;
use super::leafy::Leafy;
use super::sums::Sums;
use super::withheld::Withheld;
use crate::air_witness::InAir;
use crate::calibration::wood::LEAST_LEAF;
use crate::calibration::{Calibration, ClumpingBy, FittedRange, RegressionKind};
use crate::class::RowClass;
use crate::clumping::Clumping;
use crate::row_pass::RowPass;
use crate::voxel_edge::OtherEdge;

/// Share of the hits that may be denser than foliage: trunks and posts are.
const NO_FOLIAGE: f64 = 0.25;
/// Share of the hits in voxels that too few beams passed from which on a leaf area is none.
const UNTOLD: f64 = 0.5;
/// Share of the row's voxels that too few beams reached from which on a leaf area without a calibration is a guess: its interval is a factor of eighty wide.
/// Dense rows through wide beams hide a third (mature trees of LAI 5: 0.35).
const MOST_UNSEEN: f64 = 0.45;
/// The same with a calibration, whose own rows hide a part, too: mature trees of LAI 5 through wide beams from 1 m half of theirs.
const MOST_UNSEEN_CALIBRATED: f64 = 0.6;

/// How the sums of a row, up to its latest line, become leaf areas of any stretch of it. Made without allocation.
#[derive(Clone, Debug)]
pub(crate) struct Law<'a> {
    calibration: Option<&'a Calibration>,
    /// Why no leaf area of this row is told, whichever way it is made.
    withheld: Option<Withheld>,
    other_edge: Option<OtherEdge>,
    leafy: Leafy,
    /// The calibration's regression on I_T, or why it says nothing here.
    regression: Result<RegressionKind, Withheld>,
    contact: Counted<'a>,
    /// How the row's leaves stand, and what is made of it; `None` of rays.
    clumping: Option<Clumping>,
    /// Relative standard deviation of leaf areas by hits for what the beams' width was taken out by.
    spot_relative_sd: f64,
    /// Where remission is read, the calibration knows what to make of it, and contact bears it out.
    share: Result<Counted<'a>, Withheld>,
    reads_remission: bool,
    /// Densities are those of rays although the beams have a width.
    spot_corrected: bool,
    row: Sums,
    row_spacing_m: Option<f64>,
    tree_spacing_m: Option<f64>,
    scanned_m: f64,
}

/// A value, and where its regressor stands against the fitted range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ranged {
    leaf_m2: f64,
    pub(crate) per_metre: f64,
    pub(crate) fitted: FittedRange,
}

impl Ranged {
    pub(crate) fn known(self) -> Known {
        if self.refused() { Err(Withheld::Refused) } else { Ok(self.leaf_m2) }
    }

    pub(crate) fn refused(self) -> bool {
        self.fitted == FittedRange::FarOutside
    }
}

/// The leaf areas of a stretch, each against its fitted range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RangedAreas {
    pub(crate) contact: Ranged,
    pub(crate) share: Option<Ranged>,
    pub(crate) regression: Option<Ranged>,
}

impl RangedAreas {
    /// What the leaf area is.
    pub(crate) fn best(&self) -> Ranged {
        self.share.unwrap_or(self.contact)
    }
}

impl<'a> Law<'a> {
    pub(crate) fn of(pass: &RowPass, calibration: Option<&'a Calibration>, class: Option<&RowClass>) -> Self {
        let (row, totals) = (&pass.row, pass.row.so_far());
        let sampled = row.sampled_so_far();
        let withheld = if pass.rig.optics.is_none() {
            Some(Withheld::OpticsUnknown)
        } else if pass.other_beams().is_some() {
            Some(Withheld::OtherBeams)
        } else if row.lacks_the_echo() {
            Some(Withheld::EchoUnknown)
        } else if let Some(why) = pass.in_air().and_then(withheld_for_air) {
            Some(why)
        } else if row.other_slope().is_some_and(|slope| slope.withheld) {
            Some(Withheld::GroundSlope)
        } else if row.ground_in_canopy().is_some() {
            Some(Withheld::GroundAsCanopy)
        } else if row.takes_leaves_for_ground() {
            Some(Withheld::GroundLevel)
        } else if row.out_of_sight().is_some() {
            Some(Withheld::OutOfSight)
        } else if sampled.too_dense() > NO_FOLIAGE {
            Some(Withheld::NoFoliage)
        } else if row.stood_still().is_some_and(|stood| stood.withheld) {
            Some(Withheld::StoodStill)
        } else if row.below_ground().is_some() {
            Some(Withheld::GroundLevel)
        } else if sampled.untold() > UNTOLD {
            Some(Withheld::TooFewBeams)
        } else if row.too_many_leaves(&totals).is_some() {
            Some(Withheld::TooManyLeaves)
        } else if row.at_scanner().is_some() {
            Some(Withheld::CanopyAtScanner)
        } else if row.elsewhere(&totals, &sampled).is_some() {
            Some(Withheld::RowElsewhere)
        } else if sampled.unseen() > most_unseen(calibration, sampled.hits) {
            Some(Withheld::MostlyUnseen)
        } else if row.silent_ground().is_some() || row.unmet_ground().is_some() {
            Some(Withheld::GroundSilent)
        } else {
            row.other_side_withheld()
        };
        let spot_corrected = row.takes_out_the_spot();
        let clumping = row.clumping(&totals).map(|measured| Clumping {
            applied: measured.factor.is_some() && goes_by_clumping(calibration),
            ..measured
        });
        let times = clumping.map_or(1.0, |clumping| clumping.times());
        let contact = Counted::by_hits(&totals, times, calibration);
        let spot_relative_sd = row.spot_relative_sd(clumping.as_ref());
        let leafy = Leafy::of(calibration, class, contact.raw_m2 / totals.canopy_m);
        let mostly_wood = (leafy.share < LEAST_LEAF).then_some(Withheld::MostlyWood);
        let other_edge = OtherEdge::of(row.voxel_m(), calibration.and_then(|fitted| fitted.class.voxel_m));
        let far_edge = other_edge.filter(|other| other.relative_sd.is_none()).map(|_| Withheld::VoxelEdge);
        Self {
            calibration,
            withheld: withheld.or(far_edge).or(mostly_wood),
            other_edge,
            leafy,
            spot_corrected,
            regression: by_outline::regression(pass, calibration, spot_corrected),
            contact,
            clumping,
            spot_relative_sd,
            share: Counted::by_shares(row, &totals, &contact, calibration),
            reads_remission: reads_remission(row, &totals),
            row: Sums::from(&totals),
            row_spacing_m: pass.rig.row_spacing_m,
            tree_spacing_m: pass.rig.tree_spacing_m,
            scanned_m: pass.row.scanned_m(),
        }
    }

    /// Why no leaf area of this row is told, whichever way it is made.
    pub(crate) fn told(&self) -> Result<(), Withheld> {
        self.withheld.map_or(Ok(()), Err)
    }

    /// Why no measure is told that goes by no calibration.
    pub(crate) fn measured(&self) -> Result<(), Withheld> {
        self.told().or_else(|why| if why == Withheld::VoxelEdge { Ok(()) } else { Err(why) })
    }

    /// How much of what was met is no wood.
    pub(crate) fn leafy(&self) -> Leafy {
        self.leafy
    }

    /// How the voxels' edge differs from that of the calibration's.
    pub(crate) fn other_edge(&self) -> Option<OtherEdge> {
        self.other_edge
    }

    /// Where the leaf area comes from.
    pub(crate) fn estimator(&self) -> LeafAreaEstimator {
        match (self.calibration.is_some(), self.spot_corrected) {
            _ if self.share.is_ok() => LeafAreaEstimator::ShareCalibrated,
            (true, true) => LeafAreaEstimator::ContactCalibratedSpotCorrected,
            (true, false) => LeafAreaEstimator::ContactCalibrated,
            (false, true) => LeafAreaEstimator::ContactRawSpotCorrected,
            (false, false) => LeafAreaEstimator::ContactRaw,
        }
    }

    /// What the leaf area is counted by.
    pub(crate) fn counted(&self) -> &Counted<'a> {
        self.share.as_ref().unwrap_or(&self.contact)
    }

    /// The row's raw leaf area a metre of canopy, m.
    pub(crate) fn raw_m2_per_m(&self) -> f64 {
        self.counted().raw_m2 / self.row.length_m
    }

    /// Whether remission is read, and nearly all hits have it.
    pub(crate) fn reads_remission(&self) -> bool {
        self.reads_remission
    }

    /// Whether it goes by the shares of spots.
    pub(crate) fn goes_by_shares(&self) -> bool {
        self.share.is_ok()
    }

    /// Why it does not go by the shares of spots.
    pub(crate) fn no_shares(&self) -> Option<Withheld> {
        self.share.as_ref().err().copied()
    }

    /// What the row's shares say over what its contact says, both raw, and what 99 of 100 rows of the calibration have.
    /// `None` where the calibration says nothing of it.
    pub(crate) fn shares_over_contact(&self) -> Option<(f64, [f64; 2])> {
        shares_over_contact(self.calibration?, &self.contact, &self.row)
    }

    /// Why the regression on I_T tells nothing.
    pub(crate) fn no_regression(&self) -> Option<Withheld> {
        self.regression.err()
    }

    /// The row's leaf areas.
    pub(crate) fn row(&self) -> LeafAreas {
        self.areas(&self.row, self.scanned_m)
    }

    /// The row's sums against the fitted ranges.
    pub(crate) fn row_ranged(&self) -> RangedAreas {
        self.ranged(&self.row)
    }

    /// The leaf areas of a stretch that stands on `ground_length_m` of its row.
    pub(crate) fn areas(&self, of: &Sums, ground_length_m: f64) -> LeafAreas {
        match self.withheld {
            // What was met is known, wood or not, and whatever the calibration.
            Some(why @ (Withheld::MostlyWood | Withheld::VoxelEdge)) => {
                return LeafAreas::withheld(why).with_raw(of.contact_m2);
            }
            Some(why) => return LeafAreas::withheld(why),
            None => {}
        }
        let ranged = self.ranged(of);
        let regression =
            self.regression.and_then(|_| ranged.regression.ok_or(Withheld::Uncalibrated)?.known());
        // Leaves that were hit have an area: where the fitted line falls to 0, it tells none.
        let regression = regression.and_then(|leaf_m2| {
            if leaf_m2 > 0.0 || of.impacted_m2 <= 0.0 { Ok(leaf_m2) } else { Err(Withheld::Refused) }
        });
        LeafAreas {
            best: ranged.best().known(),
            contact: ranged.contact.known(),
            contact_raw: Ok(of.contact_m2),
            share: self.share.and_then(|_| ranged.share.ok_or(Withheld::NoShares)?.known()),
            share_raw: if self.reads_remission { Ok(of.share_m2) } else { Err(Withheld::NoShares) },
            regression,
            ground: self.ground_width_m().map(|width_m| width_m * ground_length_m),
        }
    }

    /// Ground beside a metre of row, m.
    pub(crate) fn ground_width_m(&self) -> Known {
        // Without a tree spacing nobody says how the row is planted: an index needs both.
        self.row_spacing_m.filter(|_| self.tree_spacing_m.is_some()).ok_or(Withheld::NoSpacing)
    }

    /// What sums of parts of the row are multiplied by, for parts too short to be held against a fitted range by themselves: withheld where the
    /// row's own leaf area is.
    pub(crate) fn factor(&self) -> Known {
        self.told()?;
        let Counted { clumping, factor, .. } = self.counted();
        self.row_ranged().best().known().map(|_| clumping * factor)
    }

    /// By how much the row's impacted area a metre lies beyond those of the calibration's rows: the logarithm of its ratio to the largest. `None` of a row among
    /// them.
    pub(crate) fn beyond_outline(&self) -> Option<f64> {
        let calibration = self.calibration?;
        let most_m2_per_m = calibration.quality(calibration.best_regression()).high_m2_per_m;
        let beyond = self.row.impacted_m2 / self.row.length_m / most_m2_per_m;
        Some(beyond.ln()).filter(|beyond| *beyond > 0.0 && beyond.is_finite())
    }

    /// How the row's leaves stand, and what is made of it; `None` of rays, and where nothing was hit.
    pub(crate) fn measured_clumping(&self) -> Option<Clumping> {
        self.clumping
    }

    /// Relative standard deviation of leaf areas by hits for what the beams' width was taken out by; 0 for rays.
    pub(crate) fn spot_relative_sd(&self) -> f64 {
        self.spot_relative_sd
    }

    /// Against the fitted ranges. Without a canopy return a stretch is a gap: 0, never the line's intercept.
    pub(crate) fn ranged(&self, of: &Sums) -> RangedAreas {
        let length_m = of.length_m;
        let gap = of.returns == 0 || length_m <= 0.0;
        let ranged = |leaf_m2, value_m2: f64, range: &dyn Fn(f64) -> FittedRange| {
            if gap {
                return Ranged { leaf_m2: 0.0, per_metre: 0.0, fitted: FittedRange::Inside };
            }
            let per_metre = value_m2 / length_m;
            Ranged { leaf_m2, per_metre, fitted: range(per_metre) }
        };
        let scaled = |counted: &Counted<'_>| {
            let raw_m2 = counted.raw_of(of);
            ranged(
                counted.factor * raw_m2,
                raw_m2,
                &|value| match counted.scale.map(|scale| &scale.quality) {
                    None => FittedRange::Inside,
                    Some(quality) => match quality.range(value) {
                        // Below the range it is a proportion, which holds down to nothing: thin trees are outside the range, but never far outside.
                        FittedRange::FarOutside if value < quality.low_m2_per_m => FittedRange::Outside,
                        fitted => fitted,
                    },
                },
            )
        };
        let regression = self.calibration.zip(self.regression.ok()).map(|(calibration, kind)| {
            let leaf_m2 = calibration.regression_m2(kind, length_m, of.impacted_m2);
            ranged(leaf_m2, of.impacted_m2, &|value| calibration.quality(kind).range(value))
        });
        RangedAreas {
            contact: scaled(&self.contact),
            share: self.share.as_ref().ok().map(scaled),
            regression,
        }
    }
}

/// Share of the row's voxels that too few beams reached from which on nothing is told. Of a row that no beam met a calibration knows nothing.
fn most_unseen(calibration: Option<&Calibration>, hits: u64) -> f64 {
    if calibration.is_some() && hits > 0 { MOST_UNSEEN_CALIBRATED } else { MOST_UNSEEN }
}

/// Whether leaf areas go by how the row's leaves stand: what was fitted so must be applied so.
fn goes_by_clumping(calibration: Option<&Calibration>) -> bool {
    calibration.is_some_and(|calibration| calibration.contact.clumping == ClumpingBy::Scans)
}

/// Why leaf areas are withheld for what is in the air, where they are.
fn withheld_for_air(found: InAir) -> Option<Withheld> {
    match found {
        InAir::Weather { withheld, .. } => withheld.then_some(Withheld::InTheAir),
        InAir::Rides { .. } => Some(Withheld::RidesAlong),
    }
}
