//! Warnings of a row: what is withheld, left out, or outside of what is known.

use crate::calibration::{Calibration, EchoRule, FittedRange, Optics, RegressionKind};
use crate::estimate::Estimate;
use crate::gate::Gate;
use crate::leaf::{Count, Law, RangedAreas, Withheld};
use crate::remission::CardDoubt;
use crate::resolutions::OtherResolution;
use crate::row_pass::{LatestScan, RowPass};
use crate::warning::Warning;
use rowscan_protocol::rig::{BeamWidth, EchoChoice};

/// A drive that goes on for a whole tree may have scanned so much less of it, metres: it ends between two lines.
const LINE_M: f64 = 0.05;

/// How far the class's numbers may be off the rig's, relative.
const CLASS_TOLERANCE: f64 = 0.01;

/// Says why nothing is told of the row.
pub(super) fn warn_of_withheld(estimate: &mut Estimate, gate: &Gate, pass: Option<&RowPass>, why: Withheld) {
    // Elsewhere the way itself is unknown.
    let has_way = !matches!(why, Withheld::NothingValid | Withheld::NoTime | Withheld::NoEncoder);
    if let Some(pass) = pass.filter(|_| has_way) {
        estimate.advance_m = pass.advance.advance_m();
        estimate.advance_source = pass.odometry.source();
    }
    let warning = match (why, pass) {
        (Withheld::NothingValid, _) => Warning::NothingValid,
        (Withheld::NoEncoder, Some(pass)) => Warning::NoEncoder { scans: pass.odometry.unread() },
        (Withheld::NotScanned, _) => Warning::Stood { scans: gate.valid },
        (Withheld::UnknownBeams, Some(pass)) => {
            let share = pass.row.unknown_share();
            Warning::UnknownBeams { share, limit: pass.rig.max_excluded }
        }
        (Withheld::EncoderJumped, Some(pass)) => Warning::EncoderJumped { times: pass.odometry.jumps() },
        (Withheld::TooMuchExcluded, Some(pass)) => {
            Warning::TooMuchExcluded { share: gate.blind_share(), limit: pass.rig.max_excluded }
        }
        // Told already, or no fault: nobody gave a rig.
        _ => return,
    };
    estimate.warnings.push(warning);
}

/// Lines so far before the row that the rig describes are none of it, metres.
const OUTSIDE_M: f64 = 0.25;
/// Behind it so much of its length may be a wheel's slip, up to a tree.
const SLIP: f64 = 0.05;

/// Says that lines met what stands before or behind the row that the rig describes.
pub(super) fn warn_of_row_end(estimate: &mut Estimate, pass: &RowPass) {
    let (Some(trees), Some(spacing_m)) = (pass.rig.trees, pass.rig.tree_spacing_m) else { return };
    let row_m = f64::from(trees) * spacing_m;
    let slip_m = (SLIP * row_m).min(spacing_m - LINE_M).max(OUTSIDE_M);
    let before = pass.row.metres.iter().filter(|metre| metre.index < 0);
    let past = pass.row.trees.iter().filter(|tree| tree.index >= trees.into());
    let before_m: f64 = before.map(|metre| metre.scanned_m).sum();
    let past_m: f64 = past.map(|tree| tree.scanned_m).sum();
    if before_m >= OUTSIDE_M {
        estimate.warnings.push(Warning::BeforeRow { before_m });
    }
    if past_m >= slip_m {
        estimate.warnings.push(Warning::PastRow { row_m, past_m });
    }
}

/// Says what was left out of the estimate, by cause.
pub(super) fn warn_of_excluded(estimate: &mut Estimate, gate: &Gate) {
    let warnings = &mut estimate.warnings;
    for (fault, telegrams) in gate.faults().iter() {
        warnings.push(Warning::Unreadable { fault: fault.clone(), telegrams });
    }
    warnings.extend(gate.causes().map(|(why, scans)| Warning::Excluded { why, scans }));
    let other = |OtherResolution { first_deg, other_deg, scans }| Warning::OtherResolution {
        first_deg,
        other_deg,
        scans,
    };
    warnings.extend(gate.resolutions.others().map(other));
    warnings.extend(gate.leftovers().map(|(setting, scans)| Warning::LeftOn { setting, scans }));
    if gate.contaminated > 0 {
        warnings.push(Warning::ContaminationWarning { scans: gate.contaminated });
    }
}

/// Says what is not known of remission that is to be read.
pub(super) fn warn_of_remission(estimate: &mut Estimate, pass: &RowPass, law: &Law<'_>) {
    let Some(scale) = pass.row.remission() else { return };
    if !law.reads_remission() {
        let (hits, read) = (pass.row.totals().hits, pass.row.totals().shares);
        estimate.warnings.push(Warning::RemissionMissing { hits, read });
        return;
    }
    match law.no_shares() {
        Some(Withheld::SharesDisagree) => {
            let told = law.shares_over_contact().map(|(ratio, band)| Warning::SharesDisagree { ratio, band });
            estimate.warnings.extend(told);
        }
        Some(Withheld::NoWitness) => estimate.warnings.push(Warning::NoWitness),
        Some(Withheld::CardTooShort) => estimate.warnings.push(Warning::CardTooShort),
        Some(Withheld::CardLaw) => {
            if let Some(CardDoubt::OtherLaw(misfit)) = scale.doubt {
                estimate.warnings.push(Warning::CardLaw { misfit });
            }
        }
        _ => {}
    }
    if scale.power_sd.is_none() {
        estimate.warnings.push(Warning::RemissionAssumed);
    }
}

/// Warns where the row stands outside a fitted range.
pub(super) fn warn_of_range(estimate: &mut Estimate, row: &RangedAreas, calibration: &Calibration) {
    let kind: RegressionKind = calibration.best_regression();
    let share = calibration.share.as_ref().map(|scale| (Count::Shares.name(), row.share, &scale.quality));
    let others = [
        (Count::Hits.name(), Some(row.contact), &calibration.contact.quality),
        (kind.name(), row.regression, calibration.quality(kind)),
    ];
    for (estimator, ranged, quality) in share.into_iter().chain(others) {
        let Some(ranged) = ranged.filter(|ranged| ranged.fitted != FittedRange::Inside) else { continue };
        estimate.warnings.push(Warning::OutsideFittedRange {
            estimator,
            value_m2_per_m: ranged.per_metre,
            low_m2_per_m: quality.low_m2_per_m,
            high_m2_per_m: quality.high_m2_per_m,
            refused: ranged.refused(),
        });
    }
}

/// Warns where the calibration was made for something else than what is scanned.
pub(super) fn warn_of_class(
    estimate: &mut Estimate,
    calibration: &Calibration,
    pass: &RowPass,
    latest: Option<LatestScan>,
) {
    let class = &calibration.class;
    let mut mismatch = |key, expected: String, found: String| {
        estimate.warnings.push(Warning::ClassMismatch { key, expected, found });
    };
    if !class.scanner_model.eq_ignore_ascii_case(&pass.mount.model) {
        mismatch("scanner_model", class.scanner_model.clone(), pass.mount.model.clone());
    }
    let differs = |expected: f64, found: f64| (found - expected).abs() > CLASS_TOLERANCE * expected;
    if let Some(found) =
        latest.map(|latest| latest.beams.step_deg()).filter(|f| differs(class.resolution_deg, *f))
    {
        mismatch("resolution_deg", class.resolution_deg.to_string(), found.to_string());
    }
    if let Some(found) = pass.rig.tree_spacing_m.filter(|found| differs(class.tree_spacing_m, *found)) {
        mismatch("tree_spacing_m", class.tree_spacing_m.to_string(), found.to_string());
    }
    match (class.optics, pass.rig.optics) {
        (Optics::Ideal, Some(BeamWidth::Device)) => estimate.warnings.push(Warning::CalibratedOnRays),
        (Optics::Footprint | Optics::Measured, Some(BeamWidth::Ideal)) => {
            estimate.warnings.push(Warning::ClassMismatch {
                key: "optics",
                expected: "device".to_owned(),
                found: "ideal".to_owned(),
            });
        }
        // Told with what is withheld.
        (_, None)
        | (Optics::Ideal, Some(BeamWidth::Ideal))
        | (Optics::Footprint | Optics::Measured, Some(BeamWidth::Device)) => {}
    }
    let (fitted, taken) = match (class.echo_rule, pass.mount.echo) {
        (EchoRule::First, Some(EchoChoice::Last)) => ("first", "last"),
        (EchoRule::Last, None | Some(EchoChoice::First)) => ("last", "first"),
        (EchoRule::First, None | Some(EchoChoice::First)) | (EchoRule::Last, Some(EchoChoice::Last)) => {
            return;
        }
    };
    estimate.warnings.push(Warning::ClassMismatch {
        key: "echo_rule",
        expected: fitted.to_owned(),
        found: taken.to_owned(),
    });
}
