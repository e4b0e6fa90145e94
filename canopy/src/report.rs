//! From sums to the estimate: calibration applied, warnings collected.

use crate::calibration::{Calibration, EchoRule, FittedRange, Optics, RegressionKind};
use crate::class::{Compared, Holds, Look, RowClass, Standing};
use crate::density::{Count, Counted, reads_remission};
use crate::estimate::{
    Estimate, LeafAreaEstimator, MountReport, RangeStatistics, SliceEstimate, TreeEstimate,
};
use crate::estimator::{Measure, Quantity};
use crate::gate::Gate;
use crate::odometry::AdvanceSource;
use crate::row_pass::{LatestScan, RowPass};
use crate::trees::Cell;
use crate::uncertainty::{self, Uncertainty};
use crate::warning::Warning;
use rowscan_protocol::counting::Counting;
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Mount};

/// Relative standard deviation of raw leaf areas by shares, of what rays see: between simulated rows of LAI 0.8 to 2.6, of four training systems and generators,
/// LMS111 at 1.9 m.
const SHARES_SD: f64 = 0.07;

/// By how much of a relative error in a full leaf's power the leaf area by shares is off: 1.2 to 1.6 on simulated rows, LMS111 from 4
/// to 1 m.
const BY_POWER: f64 = 1.5;

/// Share of the hits that may be denser than foliage: trunks and posts are.
const NO_FOLIAGE: f64 = 0.25;

/// How far the class's numbers may be off the rig's, relative.
const CLASS_TOLERANCE: f64 = 0.01;

pub(crate) fn estimate(
    counting: &Counting,
    gate: &Gate,
    ranges: RangeStatistics,
    latest: Option<LatestScan>,
    pass: Option<&RowPass>,
    calibration: Option<&Calibration>,
    class: Option<&RowClass>,
) -> Estimate {
    let mut estimate = Estimate {
        scans: counting.scans,
        scans_repeated: counting.repeated,
        scans_lost: counting.lost,
        scans_excluded: gate.excluded(),
        points_per_scan: latest.map(|latest| u32::from(latest.beams.count)),
        scan_frequency_hz: counting.frequency_hz(),
        scan_frequency_nominal_hz: latest
            .map(|latest| latest.frequency_hz)
            .filter(|hz| hz.is_finite() && *hz > 0.0),
        ranges,
        ..Estimate::default()
    };
    if counting.restarts > 0 {
        estimate.warnings.push(Warning::Restarts { restarts: counting.restarts });
    }
    if counting.timeless > 0 {
        estimate.warnings.push(Warning::NoTime { scans: counting.timeless });
    } else if counting.untimed > 0 {
        estimate.warnings.push(Warning::NoDeviceClock { scans: counting.untimed });
    }
    warn_of_excluded(&mut estimate, gate);
    if gate.behind_m() > 0.0 {
        estimate.warnings.push(Warning::BehindStart { length_m: gate.behind_m() });
    }
    if gate.valid == 0 {
        estimate.warnings.push(Warning::NothingValid);
        return estimate;
    }
    let Some(pass) = pass else { return estimate };
    let share = gate.blind_share();
    if counting.timeless > 0 && pass.odometry.source() != Some(AdvanceSource::Encoder) {
        // How far the tractor came meanwhile is unknown.
    } else if pass.odometry.unread() > 0 {
        estimate.warnings.push(Warning::NoEncoder { scans: pass.odometry.unread() });
    } else if share > pass.rig.max_excluded {
        estimate.advance_m = pass.advance.advance_m();
        estimate.advance_source = pass.odometry.source();
        estimate.warnings.push(Warning::TooMuchExcluded { share, limit: pass.rig.max_excluded });
    } else {
        row(&mut estimate, pass, latest, calibration);
        tell_how_sure(&mut estimate, pass, calibration, class);
    }
    estimate
}

/// Says what was left out of the estimate, by cause.
fn warn_of_excluded(estimate: &mut Estimate, gate: &Gate) {
    let warnings = &mut estimate.warnings;
    for (fault, telegrams) in gate.faults().iter() {
        warnings.push(Warning::Unreadable { fault: fault.clone(), telegrams });
    }
    warnings.extend(gate.causes().map(|(why, scans)| Warning::Excluded { why, scans }));
    if gate.contaminated > 0 {
        warnings.push(Warning::ContaminationWarning { scans: gate.contaminated });
    }
}

/// Fills in how far the leaf area may be off, and warns where the row is not of the class that it holds for.
fn tell_how_sure(
    estimate: &mut Estimate,
    pass: &RowPass,
    calibration: Option<&Calibration>,
    class: Option<&RowClass>,
) {
    let holds = calibration.map_or(Holds::Assumptions, |calibration| Holds::For(&calibration.class));
    // Classes differ in what shares tell about as much as in what hits tell: so the study's figures of hits stand for both.
    let estimator = if calibration.is_some() { "contact" } else { "contact_raw" };
    let known = class.cloned().unwrap_or_default();
    let look = Look { width: pass.rig.optics, distance_m: pass.mount.distance_m };
    let compared = known.compared(&holds, look);
    // A power law enlarges a relative error by its exponent.
    let counted = Counted::best(&pass.row, calibration);
    let raw_m2_per_m = counted.raw_m2 / pass.row.totals().canopy_m;
    let amplified = counted.scale.map_or(1.0, |scale| scale.amplification(raw_m2_per_m));
    let between = |compared: &[Compared]| uncertainty::term(compared, estimator).map(|sd| amplified * sd);
    for found in &compared {
        if let Standing::Differs { expected, found: is } = &found.standing {
            estimate.warnings.push(Warning::OutsideClass {
                key: found.key,
                expected: expected.clone(),
                found: is.clone(),
                calibrated: calibration.is_some(),
                relative_sd: between(std::slice::from_ref(found)),
            });
        }
    }
    let unknown = |found: &&Compared| found.standing == Standing::Unknown;
    let silent: Vec<Compared> = compared.iter().filter(unknown).cloned().collect();
    if !silent.is_empty() {
        let keys = silent.iter().map(|found| found.key).collect();
        estimate.warnings.push(Warning::ClassUnknown { keys, relative_sd: between(&silent) });
    }
    let sampled = uncertainty::relative_sd(pass.row.metres.iter());
    let parts = Uncertainty {
        sampling: sampled.map(|(sd, _)| amplified * sd),
        between_class: class.and_then(|_| between(&compared)),
        density: counted.scale.map(|scale| scale.density_sd(raw_m2_per_m)),
        remission: pass.row.remission().filter(|_| counted.count == Count::Shares).map(|scale| {
            amplified * uncertainty::combined([SHARES_SD, BY_POWER * scale.power_sd.unwrap_or(0.0)])
        }),
        blocks: sampled.map_or(0, |(_, blocks)| blocks),
    };
    // The error of the spot correction is part of a calibration on wide beams.
    let through_the_eye = calibration.is_some_and(|calibration| calibration.class.optics != Optics::Ideal);
    let of_spot = if through_the_eye { 0.0 } else { amplified * pass.row.spot_relative_sd() };
    let ends = |sd: f64| estimate.leaf_area_m2.map(|leaf_m2| uncertainty::interval(leaf_m2, sd));
    estimate.leaf_area_sampling_error_m2 = parts.sampling.and_then(ends);
    let (of_density, of_remission) = (parts.density.unwrap_or(0.0), parts.remission.unwrap_or(0.0));
    estimate.leaf_area_interval_m2 = parts
        .sampling
        .zip(parts.between_class)
        .and_then(|(a, b)| ends(uncertainty::combined([a, b, of_density, of_remission, of_spot])));
    estimate.leaf_area_uncertainty = Some(parts);
}

/// Fills in everything that needs a rig.
fn row(
    estimate: &mut Estimate,
    pass: &RowPass,
    latest: Option<LatestScan>,
    calibration: Option<&Calibration>,
) {
    let totals = pass.row.totals();
    let scanned_m = pass.advance.scanned_m();
    estimate.advance_m = Some(pass.advance.advance_m().unwrap_or(0.0));
    estimate.advance_source = pass.odometry.source();
    estimate.scanned_m = Some(scanned_m);
    estimate.canopy_m = Some(totals.canopy_m);
    estimate.impacted_total_area_m2 = Some(totals.impacted_m2);
    let Mount { height_m, distance_m, offset_y_m, yaw_deg, pitch_deg, roll_deg, .. } = pass.mount;
    estimate.mount = Some(MountReport { height_m, distance_m, offset_y_m, yaw_deg, pitch_deg, roll_deg });
    estimate.contact = Some(pass.row.contact_report());
    estimate.returns = Some(totals.returns);
    estimate.leaf_area_contact_raw_m2 = Some(totals.contact_m2);
    let (gaps, length_m) = pass.advance.unfilled();
    if gaps > 0 {
        estimate.warnings.push(Warning::GapsNotFilled { gaps, length_m });
    }
    if pass.odometry.held_s() > 0.0 {
        estimate.warnings.push(Warning::SpeedHeld { seconds: pass.odometry.held_s() });
    }
    if !pass.row.has_far_gate() {
        estimate.warnings.push(Warning::NoFarRowGate);
    }
    if let Some(kept) = pass.row.trees.dropped().or(pass.row.metres.dropped()) {
        estimate.warnings.push(Warning::TooManyCells { kept });
    }

    let corrected = pass.row.takes_out_the_spot();
    let leaf = LeafArea {
        calibration,
        of_rays: corrected && calibration.is_some_and(|c| c.class.optics == Optics::Ideal),
        contact: Counted::by_hits(&pass.row, calibration),
        share: Counted::by_shares(&pass.row, calibration),
    };
    let whole = leaf.of(&Cell {
        scanned_m: totals.canopy_m,
        impacted_m2: totals.impacted_m2,
        contact_m2: totals.contact_m2,
        share_m2: totals.share_m2,
        returns: totals.returns.canopy,
        ..Cell::default()
    });
    // Shares have no rims to be taken out.
    let by_shares = whole.share.is_some();
    estimate.leaf_area_spot_relative_sd =
        pass.rig.optics.map(|_| if by_shares { 0.0 } else { pass.row.spot_relative_sd() });
    estimate.leaf_area_contact_m2 = whole.contact.value();
    estimate.leaf_area_m2 = whole.best().value();
    estimate.leaf_area_share_m2 = whole.share.and_then(Ranged::value);
    estimate.leaf_area_share_raw_m2 = reads_remission(&pass.row).then_some(totals.share_m2);
    warn_of_remission(estimate, pass);
    estimate.leaf_area_regression_m2 = whole.regression.and_then(Ranged::value);
    match calibration {
        None => {
            estimate.leaf_area_estimator = Some(if corrected {
                LeafAreaEstimator::ContactRawSpotCorrected
            } else {
                LeafAreaEstimator::ContactRaw
            });
            estimate.warnings.push(Warning::Uncalibrated);
        }
        Some(calibration) => {
            estimate.leaf_area_estimator = Some(if whole.share.is_some() {
                LeafAreaEstimator::ShareCalibrated
            } else if corrected {
                LeafAreaEstimator::ContactCalibratedSpotCorrected
            } else {
                LeafAreaEstimator::ContactCalibrated
            });
            estimate.regression = Some(calibration.best_regression());
            estimate.calibration = Some(calibration.class.clone());
            estimate.leaf_area_null_m2 = Some(calibration.training.mean_leaf_area_m2_per_m * totals.canopy_m);
            warn_of_class(estimate, calibration, pass, latest);
            whole.warn(estimate, calibration);
        }
    }
    let row_spacing_m = pass.rig.row_spacing_m;
    let tree_spacing_m = pass.rig.tree_spacing_m;
    estimate.lai = tree_spacing_m.and(lai(estimate.leaf_area_m2, row_spacing_m, scanned_m));

    let mut refused = (0, 0);
    for cell in pass.row.trees.iter() {
        let cell_leaf = leaf.of(cell);
        refused.0 += u32::from(cell_leaf.best().refused());
        refused.1 += u32::from(cell_leaf.regression.is_some_and(Ranged::refused));
        let listed = tree(cell, &cell_leaf, row_spacing_m, pass.row.cut().tree_spacing_m());
        let measures = pass.row.tree_measures(cell.index).to_vec();
        estimate.trees.extend(listed.map(|tree| TreeEstimate { measures, ..tree }));
    }
    let regression = calibration.map_or("none", |c| c.best_regression().name());
    let counted = leaf.share.as_ref().unwrap_or(&leaf.contact).count.name();
    for (estimator, trees) in [(counted, refused.0), (regression, refused.1)] {
        if trees > 0 {
            estimate.warnings.push(Warning::TreesRefused { estimator, trees });
        }
    }
    estimate.measures = pass.row.measures(scanned_m);
    estimate.trees_found = pass.row.trees_found();
    estimate.slices.extend(pass.row.metres.iter().map(|cell| slice(cell, &leaf.of(cell))));
    let share = pass.row.contact_report().too_dense;
    if share > NO_FOLIAGE {
        estimate.warnings.push(Warning::NoFoliage { share });
        withhold_leaf_areas(estimate);
    }
    if pass.row.lacks_the_echo() {
        estimate.warnings.push(Warning::EchoUnknown);
        withhold_leaf_areas(estimate);
    }
}

/// Says what is not known of remission that is to be read.
fn warn_of_remission(estimate: &mut Estimate, pass: &RowPass) {
    let Some(scale) = pass.row.remission() else { return };
    if !reads_remission(&pass.row) {
        let (hits, read) = (pass.row.contact_report().hits, pass.row.totals().shares);
        estimate.warnings.push(Warning::RemissionMissing { hits, read });
    } else if scale.power_sd.is_none() {
        estimate.warnings.push(Warning::RemissionAssumed);
    }
}

/// Nothing that is told of leaves is known: because first and last echo err in opposite directions and nobody says which it was, or because
/// there are no leaves.
fn withhold_leaf_areas(estimate: &mut Estimate) {
    let of_leaves = |measure: &Measure| {
        matches!(measure.quantity, Quantity::LeafArea | Quantity::Lai | Quantity::LeafAreaDensity)
    };
    let hide = |measures: &mut Vec<Measure>| {
        for measure in measures.iter_mut().filter(|measure| of_leaves(measure)) {
            (measure.value, measure.low, measure.high) = (None, None, None);
        }
    };
    estimate.leaf_area_m2 = None;
    estimate.leaf_area_contact_m2 = None;
    estimate.leaf_area_contact_raw_m2 = None;
    estimate.leaf_area_share_m2 = None;
    estimate.leaf_area_share_raw_m2 = None;
    estimate.lai = None;
    hide(&mut estimate.measures);
    for tree in &mut estimate.trees {
        (tree.leaf_area_m2, tree.leaf_area_contact_m2, tree.lai) = (None, None, None);
        hide(&mut tree.measures);
    }
    for slice in &mut estimate.slices {
        (slice.leaf_area_m2, slice.leaf_area_contact_m2) = (None, None);
    }
}

fn tree(
    cell: &Cell,
    leaf: &CellLeafArea,
    row_spacing_m: Option<f64>,
    spacing_m: f64,
) -> Option<TreeEstimate> {
    let complete = cell.complete(spacing_m);
    let ground_m = if complete { spacing_m } else { cell.scanned_m };
    Some(TreeEstimate {
        tree: u32::try_from(cell.index).ok()?,
        y_m: (cell.index as f64 + 0.5) * spacing_m,
        complete,
        scanned_m: cell.scanned_m,
        impacted_total_area_m2: cell.impacted_m2,
        leaf_area_m2: leaf.best().value(),
        leaf_area_contact_m2: leaf.contact.value(),
        leaf_area_regression_m2: leaf.regression.and_then(Ranged::value),
        lai: lai(leaf.best().value(), row_spacing_m, ground_m),
        height_m: cell.height_m,
        volume_m3: cell.volume_m3,
        returns: cell.returns,
        measures: Vec::new(),
    })
}

fn slice(cell: &Cell, leaf: &CellLeafArea) -> SliceEstimate {
    SliceEstimate {
        y_m: cell.index as f64 + 0.5,
        scanned_m: cell.scanned_m,
        impacted_total_area_m2: cell.impacted_m2,
        leaf_area_m2: leaf.best().value(),
        leaf_area_contact_m2: leaf.contact.value(),
        leaf_area_regression_m2: leaf.regression.and_then(Ranged::value),
        returns: cell.returns,
    }
}

/// One-sided leaf area over ground area.
fn lai(leaf_m2: Option<f64>, row_spacing_m: Option<f64>, length_m: f64) -> Option<f64> {
    let ground_m2 = row_spacing_m? * length_m;
    (ground_m2 > 0.0).then_some(leaf_m2? / ground_m2)
}

/// The leaf area estimators, side by side.
struct LeafArea<'a> {
    calibration: Option<&'a Calibration>,
    /// The calibration is one of rays and the scans are not: what it says of impacted areas does not hold.
    of_rays: bool,
    contact: Counted<'a>,
    /// Where remission is read and the calibration knows what to make of it.
    share: Option<Counted<'a>>,
}

/// A value, and where its regressor stands against the fitted range.
#[derive(Clone, Copy)]
struct Ranged {
    leaf_m2: f64,
    per_metre: f64,
    fitted: FittedRange,
}

impl Ranged {
    fn value(self) -> Option<f64> {
        (!self.refused()).then_some(self.leaf_m2)
    }

    fn refused(self) -> bool {
        self.fitted == FittedRange::FarOutside
    }
}

struct CellLeafArea {
    contact: Ranged,
    share: Option<Ranged>,
    regression: Option<Ranged>,
}

impl LeafArea<'_> {
    /// Leaf area of a stretch of row. Without a canopy return it is a gap: 0, never the line's intercept.
    fn of(&self, cell: &Cell) -> CellLeafArea {
        let length_m = cell.scanned_m;
        let gap = cell.returns == 0 || length_m <= 0.0;
        let ranged = |leaf_m2, value_m2: f64, range: &dyn Fn(f64) -> FittedRange| {
            if gap {
                return Ranged { leaf_m2: 0.0, per_metre: 0.0, fitted: FittedRange::Inside };
            }
            let per_metre = value_m2 / length_m;
            Ranged { leaf_m2, per_metre, fitted: range(per_metre) }
        };
        let scaled = |counted: &Counted<'_>| {
            let raw_m2 = match counted.count {
                Count::Hits => cell.contact_m2,
                Count::Shares => cell.share_m2,
            };
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
        let regression = self.calibration.filter(|_| !self.of_rays).map(|calibration| {
            let kind = calibration.best_regression();
            let leaf_m2 = calibration.regression_m2(kind, length_m, cell.impacted_m2);
            ranged(leaf_m2, cell.impacted_m2, &|value| calibration.quality(kind).range(value))
        });
        CellLeafArea { contact: scaled(&self.contact), share: self.share.as_ref().map(scaled), regression }
    }
}

impl CellLeafArea {
    /// What the leaf area is.
    fn best(&self) -> Ranged {
        self.share.unwrap_or(self.contact)
    }

    /// Warns where the row stands outside a fitted range.
    fn warn(&self, estimate: &mut Estimate, calibration: &Calibration) {
        let kind: RegressionKind = calibration.best_regression();
        let share =
            calibration.share.as_ref().map(|scale| (Count::Shares.name(), self.share, &scale.quality));
        let others = [
            (Count::Hits.name(), Some(self.contact), &calibration.contact.quality),
            (kind.name(), self.regression, calibration.quality(kind)),
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
}

/// Warns where the calibration was made for something else than what is scanned.
fn warn_of_class(
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
        (Optics::Ideal, None) => estimate.warnings.push(Warning::IdealOptics),
        (Optics::Ideal, Some(BeamWidth::Device)) => estimate.warnings.push(Warning::CalibratedOnRays),
        (Optics::Footprint | Optics::Measured, found @ (None | Some(BeamWidth::Ideal))) => {
            let found = if found.is_some() { "ideal" } else { "unknown" };
            estimate.warnings.push(Warning::ClassMismatch {
                key: "optics",
                expected: "device".to_owned(),
                found: found.to_owned(),
            });
        }
        (Optics::Ideal, Some(BeamWidth::Ideal))
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
