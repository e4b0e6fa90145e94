//! From sums to the estimate: calibration applied, warnings collected.

mod warned;

use crate::across::{Faces, Growth};
use crate::air_witness::InAir;
use crate::beam_witness::OtherBeams;
use crate::by_height::{self, ByHeight};
use crate::calibration::{Calibration, CalibrationClass, Optics};
use crate::class::{Compared, Holds, Look, RowClass, ScanGeometry, Standing};
use crate::estimate::{
    ContactReport, Estimate, MountReport, RangeStatistics, SidesReport, SliceEstimate, TreeEstimate,
};
use crate::estimator::Measure;
use crate::gate::Gate;
use crate::ground_line::OtherSlope;
use crate::leaf::{Count, Law, LeafAreas, Leafy, PieceLeaf, RowLeaf, Sums, Withheld, by_outline};
use crate::level::LevelSurface;
use crate::odometry::AdvanceSource;
use crate::pieces::{self, PieceScatter, RowSds};
use crate::row_pass::{LatestScan, RowPass};
use crate::still_witness::StoodStill;
use crate::trees::{Cell, is_missing};
use crate::uncertainty::{self, Uncertainty, blocks};
use crate::voxel_edge::OtherEdge;
use crate::warning::Warning;
use rowscan_protocol::counting::Counting;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Mount;
use warned::{
    warn_of_class, warn_of_excluded, warn_of_range, warn_of_remission, warn_of_row_end, warn_of_withheld,
};

/// Relative standard deviation of raw leaf areas by shares, of what rays see: between simulated rows of LAI 0.8 to 2.6, of four training systems and generators,
/// LMS111 at 1.9 m.
const SHARES_SD: f64 = 0.07;

/// By how much of a relative error in a full leaf's power the leaf area by shares is off: 1.2 to 1.6 on simulated rows, LMS111 from 4
/// to 1 m.
const BY_POWER: f64 = 1.5;

/// Share of turns left out above which it is told: fewer are filled from their neighbours.
const TURNS_TOLD: f64 = 0.01;
/// A speed that was held for less is not told, seconds: that is the time from a packet to the scan in it.
const SPEED_HELD_S: f64 = 0.05;
/// Share of a tree that must have been scanned for it to lie outside a range: less is a strip of its edge.
const LEAST_OF_TREE: f64 = 0.5;

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
        scans_late: counting.late,
        scans_lost: counting.all_lost(),
        turns_left_out: counting.turns_left_out(),
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
    let (turns, of) = (counting.turns_left_out(), counting.turns());
    if turns as f64 > TURNS_TOLD * of as f64 {
        estimate.warnings.push(Warning::TurnsLeftOut { turns, of });
    }
    if counting.contradicting > 0 {
        estimate.warnings.push(Warning::CountersContradict { scans: counting.contradicting });
    }
    warn_of_excluded(&mut estimate, gate);
    if gate.behind_m() > 0.0 {
        estimate.warnings.push(Warning::BehindStart { length_m: gate.behind_m() });
    }
    estimate.warnings.extend(pass.into_iter().flat_map(|pass| pass.doubts_of_encoder(gate.valid)));
    match areas_told(counting, gate, pass) {
        Ok(pass) => {
            let law = Law::of(pass, calibration, class);
            row(&mut estimate, pass, latest, &law, calibration);
            let sds = tell_how_sure(&mut estimate, pass, &law, calibration, class);
            pieces::tell(&mut estimate, piece_scatter(pass, &law), pass.row.cut().tree_spacing_m(), sds);
            if let Some(by_height) = pass.row.by_height() {
                by_height::tell(&mut estimate, by_height, &law, sds);
            }
        }
        Err(why) => {
            estimate.leaf = RowLeaf::withheld(why);
            estimate.profile = pass.and_then(|pass| pass.row.by_height()).map(ByHeight::nothing_told);
            warn_of_withheld(&mut estimate, gate, pass, why);
        }
    }
    estimate
}

/// The row, if its areas are told; asked for every frame on the bus too, so without allocation.
///
/// # Errors
/// Why nothing is told of the row.
pub(crate) fn areas_told<'a>(
    counting: &Counting,
    gate: &Gate,
    pass: Option<&'a RowPass>,
) -> Result<&'a RowPass, Withheld> {
    if gate.valid == 0 {
        return Err(Withheld::NothingValid);
    }
    let pass = pass.ok_or(Withheld::NoRig)?;
    let by_encoder = pass.odometry.source() == Some(AdvanceSource::Encoder);
    if counting.timeless > 0 && !by_encoder {
        // How far the tractor came meanwhile is unknown.
        Err(Withheld::NoTime)
    } else if by_encoder && pass.odometry.unread() > 0 {
        Err(Withheld::NoEncoder)
    } else if by_encoder && pass.witness.is_stuck(gate.valid) {
        Err(Withheld::EncoderStuck)
    } else if by_encoder && pass.witness.has_other_scale() {
        Err(Withheld::EncoderSpeed)
    } else if by_encoder && pass.odometry.is_lost(gate.valid) {
        Err(Withheld::EncoderJumped)
    } else if gate.valid > 1 && pass.advance.advance_m() == Some(0.0) {
        // Nothing was driven past.
        Err(Withheld::NotScanned)
    } else if pass.row.unknown_share() > pass.rig.max_excluded {
        Err(Withheld::UnknownBeams)
    } else if gate.blind_share() > pass.rig.max_excluded {
        Err(Withheld::TooMuchExcluded)
    } else {
        Ok(pass)
    }
}

/// Fills in how far the leaf area may be off, and warns where the row is not of the class that it holds for.
fn tell_how_sure(
    estimate: &mut Estimate,
    pass: &RowPass,
    law: &Law<'_>,
    calibration: Option<&Calibration>,
    class: Option<&RowClass>,
) -> RowSds {
    let holds = calibration.map_or(Holds::Assumptions, |calibration| Holds::For(&calibration.class));
    // Classes differ in what shares tell about as much as in what hits tell: so the study's figures of hits stand for both.
    let estimator = if calibration.is_some() { "contact" } else { uncertainty::RAW };
    let known = class.cloned().unwrap_or_default();
    let look = Look {
        width: pass.rig.optics,
        geometry: ScanGeometry {
            distance_m: Some(pass.mount.distance_m),
            height_m: Some(pass.mount.height_m),
            line_spacing_m: pass.row.totals().line_spacing_m(),
            crown_depth_m: pass.row.crown_depth_m(),
        },
        planned_spacing_m: pass.row.planned_spacing_m(),
    };
    let compared = known.compared(&holds, look);
    // A power law enlarges a relative error by its exponent.
    let counted = law.counted();
    let raw_m2_per_m = law.raw_m2_per_m();
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
    if let Err(blocks) = sampled
        && blocks < blocks::FEWEST
        && estimate.leaf.areas.best_m2().is_ok()
    {
        estimate.warnings.push(Warning::TooFewBlocks { blocks, expected: blocks::FEWEST });
    }
    let sampled = sampled.ok();
    let so_far = pass.row.sampled_so_far();
    let unresolved = so_far.unresolved(pass.row.voxel_m());
    let parts = Uncertainty {
        sampling: sampled.map(|(sd, _)| amplified * sd),
        between_class: class.and_then(|_| between(&compared)),
        density: Some(match counted.scale {
            Some(scale) => scale.density_sd(raw_m2_per_m),
            None => unresolved.relative_sd(),
        }),
        own_law: counted.scale.and_then(|scale| scale.own_law(raw_m2_per_m)),
        own_law_weighs: counted.scale.and_then(|scale| scale.own_law_weighs(raw_m2_per_m)),
        uneven: counted.scale.and_then(|scale| {
            uncertainty::uneven(pass.row.standing_trees(), scale.p, |tree| tree.contact_m2)
        }),
        rows: counted.scale.and_then(|scale| scale.scatter_sd(pass.row.totals().canopy_m)),
        wood: counted.scale.and_then(|scale| scale.wood_sd(raw_m2_per_m)),
        calibration: counted.scale.and_then(|scale| scale.k_sd),
        remission: pass.row.remission().filter(|_| counted.count == Count::Shares).map(|scale| {
            let power_sd = uncertainty::combined([scale.power_sd.unwrap_or(0.0), scale.rig_sd]);
            amplified * uncertainty::combined([SHARES_SD, BY_POWER * power_sd])
        }),
        min_share: Some(pass.row.least_share_relative_sd()).filter(|sd| *sd > 0.0).map(|sd| amplified * sd),
        distance: Some(pass.mount.distance_sd_m)
            .filter(|sd_m| *sd_m > 0.0)
            .map(|sd_m| amplified * uncertainty::distance_sd(so_far.hidden(), sd_m)),
        voxels: law.other_edge().and_then(|other| other.relative_sd).map(|sd| amplified * sd),
        sides: estimate.other_side.map(|_| amplified * uncertainty::SIDES_SD),
        outline: law.beyond_outline().map(uncertainty::outline_sd),
        spacing: calibration.and_then(|fitted| {
            let spacing_m = by_outline::other_spacing(pass, &fitted.class)?;
            Some(uncertainty::spacing_sd(spacing_m / fitted.class.tree_spacing_m))
        }),
        growth: pass
            .row
            .growth_in_alley()
            .map(|growth| amplified * uncertainty::without_growth(so_far.within_growth(growth.bands))),
        yaw: Some(uncertainty::without_yaw(pass.mount.yaw_deg)).filter(|shift| *shift < 0.0),
        unresolved: counted.scale.is_none().then(|| unresolved.more()),
        blocks: sampled.map_or(0, |(_, blocks)| blocks),
    };
    // The error of the spot correction is part of a calibration on wide beams.
    let through_the_eye = calibration.is_some_and(|calibration| calibration.class.optics != Optics::Ideal);
    let of_spot = if through_the_eye { 0.0 } else { amplified * law.spot_relative_sd() };
    let leaf = &mut estimate.leaf;
    let leaf_m2 = leaf.areas.best_m2().ok();
    let ends = |sd: f64| leaf_m2.map(|leaf_m2| uncertainty::interval(leaf_m2, sd));
    let relative = |sd: Option<f64>| sd.unwrap_or(0.0);
    let of_rows = parts.sampling.map(|sampling| {
        let rows = sampling.max(relative(parts.rows));
        uncertainty::combined([
            rows,
            relative(parts.density),
            relative(parts.wood),
            relative(parts.calibration),
            relative(parts.outline),
            relative(parts.spacing),
        ])
    });
    // Errors of the raw leaf area, which a steeper law makes more of.
    let of_raw = parts.between_class.map(|between_class| {
        let others =
            [parts.remission, parts.min_share, parts.distance, parts.voxels, parts.sides].map(relative);
        uncertainty::combined(others.into_iter().chain([between_class, of_spot]))
    });
    let weighed = |weighs: f64| {
        of_rows.zip(of_raw).map(|(of_rows, of_raw)| uncertainty::combined([of_rows, weighs * of_raw]))
    };
    let (about, own_law) = (weighed(1.0), relative(parts.own_law));
    let about_own = weighed(parts.own_law_weighs.unwrap_or(1.0));
    leaf.sampling_error_m2 = parts.sampling.and_then(ends);
    let shifts @ [uneven, growth, unresolved, yaw] =
        [parts.uneven, parts.growth, parts.unresolved, parts.yaw].map(relative);
    // By each law that may hold: the one that is applied, that of the calibration's own rows, the applied one tree by tree, without what grows in the alley, with
    // what dense leaves may hide, and without what a yaw adds.
    let laws = [(0.0, about), (own_law, about_own)].into_iter().chain(shifts.map(|shift| (shift, about)));
    let by_law = |leaf_m2: f64| {
        laws.filter_map(|(shift, sd)| Some(uncertainty::interval(leaf_m2 * shift.exp(), sd?)))
            .reduce(uncertainty::either)
    };
    leaf.interval_m2 = leaf_m2.and_then(by_law);
    leaf.uncertainty = Some(parts);
    // Pieces are drawn toward the row, by whichever law: their intervals take the difference of the two as one more cause.
    RowSds {
        sampling: parts.sampling,
        all: about_own.map(|sd| uncertainty::combined([sd, own_law, uneven])),
        shifts: [growth + yaw, unresolved],
        smeared_m: uncertainty::smeared_m(pass.mount.yaw_deg),
    }
}

/// What is known of the pieces of a row that is measured like this.
fn piece_scatter(pass: &RowPass, law: &Law<'_>) -> Option<&'static PieceScatter> {
    let beams = if pass.row.takes_out_the_spot() { "eye" } else { "rays" };
    let Mount { model, distance_m, .. } = &pass.mount;
    PieceScatter::find(law.counted().count.name(), beams, model, *distance_m)
}

/// Fills in everything that needs a rig.
fn row(
    estimate: &mut Estimate,
    pass: &RowPass,
    latest: Option<LatestScan>,
    law: &Law<'_>,
    calibration: Option<&Calibration>,
) {
    let (leaves, measured) = (law.told(), law.measured());
    let totals = &pass.row.so_far();
    let scanned_m = pass.row.scanned_m();
    estimate.advance_m = Some(pass.advance.advance_m().unwrap_or(0.0));
    estimate.advance_source = pass.odometry.source();
    estimate.scanned_m = Some(scanned_m);
    estimate.canopy_m = Some(totals.canopy_m);
    estimate.crown_depth_m = pass.row.crown_depth_m();
    estimate.impacted_total_area_m2 = Some(totals.impacted_m2);
    let Mount { height_m, distance_m, offset_y_m, yaw_deg, pitch_deg, roll_deg, .. } = pass.mount;
    estimate.mount = Some(MountReport { height_m, distance_m, offset_y_m, yaw_deg, pitch_deg, roll_deg });
    let contact = pass.row.contact_report();
    let filled_m2 = contact.leaf_area_filled_m2.filter(|_| measured.is_ok());
    estimate.contact =
        Some(ContactReport { leaf_area_filled_m2: filled_m2, clumping: law.measured_clumping(), ..contact });
    estimate.other_side = pass.row.sides();
    if let Some(SidesReport { correlation: Some(_), shift_m: Some(shift_m), .. }) = estimate.other_side {
        estimate.warnings.push(Warning::SidesShifted { shift_m });
    }
    if let Some(SidesReport { slices_joined: 0, .. }) = estimate.other_side {
        estimate.warnings.push(Warning::SidesApart);
    }
    if let Some(SidesReport { opposite: false, slices_joined: 1.., .. }) = estimate.other_side {
        estimate.warnings.push(Warning::SidesSame);
    }
    estimate.returns = Some(totals.returns);
    let (gaps, length_m) = pass.advance.unfilled();
    if gaps > 0 {
        estimate.warnings.push(Warning::GapsNotFilled { gaps, length_m });
    }
    // Areas are told, so the encoder is not what the advance hangs on.
    if pass.odometry.unread() > 0 {
        let (scans, speed_m_s) = (pass.odometry.unread(), pass.rig.speed_m_s);
        let has_encoder = AnyModel::by_name(&pass.mount.model).is_none_or(AnyModel::tells_ticks);
        estimate.warnings.push(Warning::ConstantSpeed { scans, speed_m_s, has_encoder });
    }
    if pass.odometry.jumps() > 0 {
        estimate.warnings.push(Warning::EncoderJumped { times: pass.odometry.jumps() });
    }
    if pass.odometry.held_s() >= SPEED_HELD_S {
        estimate.warnings.push(Warning::SpeedHeld { seconds: pass.odometry.held_s() });
    }
    estimate.warnings.extend(pass.doubt_of_way());
    warn_of_row_end(estimate, pass);
    let ground = pass.row.ground_in_canopy();
    if let Some(LevelSurface { z_m, share }) = ground {
        estimate.warnings.push(Warning::GroundAsCanopy { share, z_m });
    }
    // What returns in the air, at any height, has a slope of its own.
    let is_in_air = matches!(leaves, Err(Withheld::InTheAir | Withheld::RidesAlong));
    let other_slope = pass.row.other_slope().filter(|_| !is_in_air);
    if let Some(OtherSlope { found_deg, told_deg, withheld }) = other_slope {
        estimate.warnings.push(Warning::GroundSlope { found_deg, told_deg, withheld });
    }
    if let Some(level_m) = pass.row.other_level_m().filter(|_| ground.is_none()) {
        let clearance_m = pass.row.frame().ground_clearance_m;
        let withheld = pass.row.takes_leaves_for_ground();
        estimate.warnings.push(Warning::GroundLevel { level_m, clearance_m, withheld });
    } else if let Some(share) = pass.row.below_ground() {
        estimate.warnings.push(Warning::BelowGround { share });
    }
    if let Some(share) = pass.row.cut_by_clearance() {
        let clearance_m = pass.row.frame().ground_clearance_m;
        estimate.warnings.push(Warning::Clearance { share, clearance_m });
    }
    if let Some(Growth { share, .. }) = pass.row.growth_in_alley() {
        let clearance_m = pass.row.frame().ground_clearance_m;
        estimate.warnings.push(Warning::GrowthInAlley { share, clearance_m });
    }
    if !pass.row.has_far_gate() {
        estimate.warnings.push(Warning::NoFarRowGate);
    }
    if let Some(kept) = pass.row.trees.dropped().or(pass.row.metres.dropped()) {
        estimate.warnings.push(Warning::TooManyCells { kept });
    }

    let leaf = &mut estimate.leaf;
    leaf.areas = law.row();
    // Shares have no rims to be taken out.
    leaf.spot_relative_sd =
        pass.rig.optics.map(|_| if law.goes_by_shares() { 0.0 } else { law.spot_relative_sd() });
    leaf.estimator = Some(law.estimator());
    leaf.regression = calibration.map(Calibration::best_regression);
    let mean_m2_per_m = calibration.filter(|_| leaves.is_ok()).map(|c| c.training.mean_leaf_area_m2_per_m);
    leaf.null_m2 = mean_m2_per_m.map(|mean_m2_per_m| mean_m2_per_m * totals.canopy_m);
    warn_of_remission(estimate, pass, law);
    match calibration {
        None => estimate.warnings.push(Warning::Uncalibrated),
        Some(calibration) => {
            estimate.calibration = Some(calibration.class.clone());
            warn_of_class(estimate, calibration, pass, latest);
            if let Some(OtherEdge { edge_m, calibrated_m, relative_sd }) = law.other_edge() {
                estimate.warnings.push(Warning::VoxelEdge { edge_m, calibrated_m, relative_sd });
            }
            warn_of_range(estimate, &law.row_ranged(), calibration);
            estimate.warnings.extend(no_regression(law, pass, calibration));
        }
    }

    let spacing_m = pass.row.cut().tree_spacing_m();
    let is_missing = is_missing(&pass.row.trees, spacing_m);
    let mut refused = (0, 0);
    for cell in pass.row.trees.iter() {
        let ranged = law.ranged(&Sums::from(cell));
        // What a neighbour's branch makes of an empty place is no tree outside a range, nor is the strip of one at the row's end.
        let stands = !is_missing(cell) && cell.scanned_m > LEAST_OF_TREE * spacing_m;
        refused.0 += u32::from(stands && ranged.best().refused());
        refused.1 += u32::from(stands && ranged.regression.is_some_and(|regression| regression.refused()));
        // By what was scanned of it: a whole number of lines is seldom just a tree.
        let leaf = law.areas(&Sums::from(cell), cell.scanned_m);
        let measures =
            pass.row.tree_measures(cell.index).iter().map(|measure| measure.told(measured)).collect();
        let listed = tree(cell, leaf, spacing_m);
        estimate.trees.extend(listed.map(|tree| TreeEstimate { measures, ..tree }));
    }
    let regression = calibration.map_or("none", |c| c.best_regression().name());
    for (estimator, trees) in [(law.counted().count.name(), refused.0), (regression, refused.1)] {
        if trees > 0 {
            estimate.warnings.push(Warning::TreesRefused { estimator, trees });
        }
    }
    estimate.measures =
        pass.row.measures(scanned_m).into_iter().map(|measure: Measure| measure.told(measured)).collect();
    estimate.trees_found = pass.row.trees_found(measured);
    let metres = || pass.row.metres.iter();
    estimate.slices.extend(metres().map(|cell| slice(cell, law.areas(&Sums::from(cell), cell.scanned_m))));
    let refused = metres().filter(|cell| law.ranged(&Sums::from(*cell)).best().refused()).count() as u32;
    if refused > 0 {
        let estimator = law.counted().count.name();
        estimate.warnings.push(Warning::MetresRefused {
            estimator,
            metres: refused,
            of: metres().count() as u32,
        });
    }
    let other_echo = pass.other_echo.zip(pass.mount.echo);
    estimate.warnings.extend(other_echo.map(|(given, told)| Warning::OtherEcho { told, given }));
    estimate.warnings.extend(pass.in_air().map(|found| match found {
        InAir::Weather { shares, withheld } => Warning::InTheAir { shares, withheld },
        InAir::Rides { share, length_m } => {
            Warning::RidesAlong { share, length_m, distance_m: pass.mount.distance_m }
        }
    }));
    let stood =
        |StoodStill { share, withheld }| Warning::StoodStill { share, withheld, by: pass.odometry.source() };
    estimate.warnings.extend(pass.row.stood_still().map(stood));
    match leaves {
        Err(Withheld::NoFoliage) => {
            estimate.warnings.push(Warning::NoFoliage { share: contact.too_dense });
        }
        Err(Withheld::OutOfSight) => {
            let share = pass.row.out_of_sight().unwrap_or(1.0);
            estimate.warnings.push(Warning::OutOfSight { share });
        }
        Err(Withheld::TooFewBeams) => {
            let (share, voxel_m) = (pass.row.sampled_so_far().untold(), pass.row.voxel_m());
            estimate.warnings.push(Warning::TooFewBeams { share, voxel_m });
        }
        Err(Withheld::TooManyLeaves) => {
            let lai = pass.row.too_many_leaves(totals).unwrap_or(f64::INFINITY);
            estimate.warnings.push(Warning::TooManyLeaves { lai });
        }
        Err(Withheld::CanopyAtScanner) => {
            let warning = |share| Warning::CanopyAtScanner { share, distance_m: pass.mount.distance_m };
            estimate.warnings.extend(pass.row.at_scanner().map(warning));
        }
        Err(Withheld::RowElsewhere) => {
            let elsewhere = pass.row.elsewhere(totals, &pass.row.sampled_so_far());
            if let Some(Faces { near_m, far_m }) = elsewhere {
                let distance_m = pass.mount.distance_m;
                estimate.warnings.push(Warning::RowElsewhere { near_m, far_m, distance_m });
            }
        }
        Err(Withheld::MostlyUnseen) => {
            estimate.warnings.push(Warning::MostlyUnseen { share: pass.row.sampled_so_far().unseen() });
        }
        Err(Withheld::GroundSilent) => {
            estimate.warnings.extend(match pass.row.silent_ground() {
                Some(share) => Some(Warning::GroundSilent { share }),
                None => pass.row.unmet_ground().map(|share| Warning::GroundUnmet { share }),
            });
        }
        Err(Withheld::MostlyWood) => {
            let Leafy { share, by_class } = law.leafy();
            estimate.warnings.push(Warning::MostlyWood { leaf: share, by_class });
        }
        Err(Withheld::EchoUnknown) => estimate.warnings.push(Warning::EchoUnknown),
        Err(Withheld::OpticsUnknown) => estimate.warnings.push(Warning::OpticsUnknown),
        Err(Withheld::OtherBeams) => {
            let warning = |OtherBeams { found, exact }| Warning::OtherBeams { found, exact };
            estimate.warnings.extend(pass.other_beams().map(warning));
        }
        _ => {}
    }
}

/// Why the calibration's regression on I_T tells nothing of this row.
fn no_regression(law: &Law<'_>, pass: &RowPass, calibration: &Calibration) -> Option<Warning> {
    let kind = calibration.best_regression();
    let class = &calibration.class;
    match law.no_regression()? {
        Withheld::OtherMount => {
            let turned_deg = [class.yaw_deg, class.pitch_deg].map(Option::unwrap_or_default);
            let CalibrationClass { distance_m, height_m, .. } = *class;
            Some(Warning::OtherMount { distance_m, height_m, turned_deg })
        }
        Withheld::OtherSpacing => {
            let spacing_m = by_outline::other_spacing(pass, class)?;
            Some(Warning::OtherSpacing { calibrated_m: class.tree_spacing_m, spacing_m })
        }
        Withheld::WeakRegression => {
            Some(Warning::WeakRegression { r2: calibration.quality(kind).r2_left_out() })
        }
        Withheld::UnevenTrees => {
            let shift = by_outline::uneven(pass, calibration, kind)?;
            Some(Warning::UnevenTrees { ratio: shift.exp() })
        }
        _ => None,
    }
}

fn tree(cell: &Cell, leaf: LeafAreas, spacing_m: f64) -> Option<TreeEstimate> {
    Some(TreeEstimate {
        tree: u32::try_from(cell.index).ok()?,
        y_m: (cell.index as f64 + 0.5) * spacing_m,
        complete: cell.complete(spacing_m),
        scanned_m: cell.scanned_m,
        impacted_total_area_m2: cell.impacted_m2,
        leaf: PieceLeaf::measured(leaf),
        height_m: cell.height_m,
        volume_m3: cell.volume_m3,
        returns: cell.returns,
        measures: Vec::new(),
    })
}

fn slice(cell: &Cell, leaf: LeafAreas) -> SliceEstimate {
    SliceEstimate {
        y_m: cell.index as f64 + 0.5,
        scanned_m: cell.scanned_m,
        impacted_total_area_m2: cell.impacted_m2,
        leaf: PieceLeaf::measured(leaf),
        returns: cell.returns,
    }
}
