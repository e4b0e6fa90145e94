//! Whether the calibration's regression on I_T holds for a row: what a row shows of its outline goes with how it is planted and with where it is seen from.

use super::withheld::Withheld;
use crate::calibration::{Calibration, CalibrationClass, Optics, RegressionKind};
use crate::row_pass::RowPass;
use crate::uncertainty;
use rowscan_protocol::rig::Mount;

/// Of what rows differ by, a regression must tell this share, of rows that were not fitted: else the rows' mean is as good.
const LEAST_R2: f64 = 0.5;
/// A mount so many times as far from the row, or as high, sees another I_T.
const OTHER_PLACE_RATIO: f64 = 1.15;
/// So does a plane that is turned, or leans, by so much more, degrees.
const MOST_LEANING_DEG: f64 = 5.0;
/// Trees so many times as far apart have another I_T a metre: spindles of 1.4 m by the calibration of 1.5 m read 16 to 22 % more leaves, of 1.6 m 9 to 14 % less.
const OTHER_SPACING_RATIO: f64 = 1.05;
/// A power of a row's mean that differs by so much from the mean of its trees' powers, as a logarithm, tells nothing. Rows of one planting differ by 0.02 at most; with
/// one young tree of twelve by 0.18, and the leaf area is 10 to 18 % low.
const MOST_UNEVEN: f64 = 0.1;

/// The regression on I_T that a calibration has for this row, such beams and this mount.
///
/// # Errors
/// Why there is none.
pub(super) fn regression(
    pass: &RowPass,
    calibration: Option<&Calibration>,
    spot_corrected: bool,
) -> Result<RegressionKind, Withheld> {
    let calibration = calibration.ok_or(Withheld::Uncalibrated)?;
    if spot_corrected && calibration.class.optics == Optics::Ideal {
        return Err(Withheld::CalibratedOnRays);
    }
    if is_seen_from_elsewhere(&calibration.class, &pass.mount) {
        return Err(Withheld::OtherMount);
    }
    if other_spacing(pass, &calibration.class).is_some() {
        return Err(Withheld::OtherSpacing);
    }
    let kind = calibration.best_regression();
    if calibration.quality(kind).r2_left_out() < LEAST_R2 {
        return Err(Withheld::WeakRegression);
    }
    if uneven(pass, calibration, kind).is_some() { Err(Withheld::UnevenTrees) } else { Ok(kind) }
}

/// The rig's tree spacing where it is another than that of the calibration's rows, metres.
pub(crate) fn other_spacing(pass: &RowPass, class: &CalibrationClass) -> Option<f64> {
    let ratio = |spacing_m: &f64| (spacing_m / class.tree_spacing_m).ln().abs();
    pass.rig.tree_spacing_m.filter(|spacing_m| ratio(spacing_m) > OTHER_SPACING_RATIO.ln())
}

/// What the regression tells tree by tree over what it tells of their mean, as a logarithm, where trees differ by too much for it.
pub(crate) fn uneven(pass: &RowPass, calibration: &Calibration, kind: RegressionKind) -> Option<f64> {
    let exponent = match kind {
        RegressionKind::Power => calibration.power.p,
        RegressionKind::Linear => 1.0,
    };
    let spacing_m = pass.rig.tree_spacing_m?;
    let trees = pass.row.standing_trees().filter(|tree| tree.complete(spacing_m));
    let shift = uncertainty::uneven(trees, exponent, |tree| tree.impacted_m2);
    shift.filter(|shift| *shift > MOST_UNEVEN)
}

/// Whether I_T of this mount is none of the calibration's rows'. It goes with where it is seen from, and nothing takes that out: by the calibration of upright
/// scanners 1.9 m away and 1.6 m high, the same row reads 20 % less from 1.4 m, 15 % more from 2.2 m, 22 % less from 2.5 m up, and 12 % more with a yaw of 10°.
fn is_seen_from_elsewhere(class: &CalibrationClass, mount: &Mount) -> bool {
    let is_other = |fitted: Option<f64>, own: f64| {
        fitted.is_some_and(|fitted| (own / fitted).ln().abs() > OTHER_PLACE_RATIO.ln())
    };
    let leans_otherwise =
        |fitted: Option<f64>, own: f64| (own - fitted.unwrap_or_default()).abs() > MOST_LEANING_DEG;
    is_other(class.distance_m, mount.distance_m)
        || is_other(class.height_m, mount.height_m)
        || leans_otherwise(class.yaw_deg, mount.yaw_deg)
        || leans_otherwise(class.pitch_deg, mount.pitch_deg)
}
