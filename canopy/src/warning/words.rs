//! Warnings in words: the code, what was found, what follows, and what to do.

use std::fmt;

use rowscan_protocol::model::AnyModel;
use rowscan_protocol::plural::plural;
use rowscan_protocol::rig::BeamWidth;

use super::Warning;
use crate::across::NEAR_SCANNER_M;
use crate::air_witness::BESIDE_SCANNER_M;
use crate::class::ClassKey;
use crate::gate::Exclusion;
use crate::level::{FAR_BELOW_M, GRASS_M};
use crate::odometry::AdvanceSource;
use crate::remission::RemissionScale;

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.code())?;
        match self {
            Self::Uncalibrated => {
                f.write_str("leaf area is the raw contact frequency, wood included; name a calibration that there is for this scanner's model, in the rig or with --calibration")
            }
            Self::NoFarRowGate => {
                f.write_str("the rig has no row_spacing_m, so returns from the next row count as canopy")
            }
            Self::OpticsUnknown => f.write_str(
                "the rig does not say how wide the scanner's beams are, and a real beam's width makes leaf area by contact 1.5 to 3 times as large: leaf areas \
                 are withheld; add optics = \"device\" below [rig] for a real scanner or scans through the device's optics, optics = \"ideal\" for \
                 simulated rays",
            ),
            Self::WeakRegression { r2 } => write!(
                f,
                "the calibration's regression on I_T tells {:.0} % of what rows differ by, of rows that were not fitted: it is withheld",
                100.0 * r2.max(0.0)
            ),
            Self::OtherMount { distance_m, height_m, turned_deg: [yaw, pitch] } => {
                let metres = |known: &Option<f64>| known.map_or("unknown".to_owned(), |m| format!("{m} m"));
                write!(
                    f,
                    "the calibration's regression on I_T is of rows seen from a distance of {} and a height of {} with a yaw of {yaw}° and a pitch of {pitch}°, and I_T goes with where a row is seen from: the leaf area by I_T is withheld; that by contact is not",
                    metres(distance_m),
                    metres(height_m)
                )
            }
            Self::OtherSpacing { calibrated_m, spacing_m } => write!(
                f,
                "the calibration's regression on I_T is of rows whose trees stand {calibrated_m} m apart, and the rig's stand {spacing_m} m apart: a metre of row shows another outline of the same leaves; \
                 the leaf area by I_T is withheld; that by contact is not, and its interval is wider"
            ),
            Self::UnevenTrees { ratio } => write!(
                f,
                "trees differ so much that the calibration's regression on I_T tells {ratio:.2} times as much tree by tree as of their mean: the leaf area by I_T is withheld; that by contact is not"
            ),
            Self::SharesDisagree { ratio, band: [low, high] } => write!(
                f,
                "shares of spots say {ratio:.2} times what contact says, the calibration's rows {low:.2} to {high:.2} times: something changes the power that \
                 returns (a dirty or wet window, wet or other leaves, a misread card), or the row is of another class; the leaf area is by contact"
            ),
            Self::NoWitness => f.write_str(
                "the calibration does not say how shares of spots and contact agree ([witness]): the leaf area is by contact; make the calibration anew with \
                 `rowscan study calibration`",
            ),
            Self::CardTooShort => write!(
                f,
                "the card of rig.scanner.remission has too few readings for its curve: expected {} or more, {} of them on each side of the near field's end \
                 (1.5 m), neighbours within a factor of {}; the leaf area is by contact",
                RemissionScale::LEAST_READINGS,
                RemissionScale::LEAST_A_SIDE,
                RemissionScale::WIDEST_STEP
            ),
            Self::CardLaw { misfit } => write!(
                f,
                "the other cards of rig.scanner.remission are {:.1} digits off the logarithm of power that digits_a_decade says, {:.1} off a line and {:.1} off a \
                 square root ({}): the leaf area is by contact; measure the cards anew, correct digits_a_decade, or say with power_sd how little is known",
                misfit.logarithm, misfit.line, misfit.root, misfit.best()
            ),
            Self::OtherBeams { found, exact } => {
                let name = found.name();
                let (found, said) = match found {
                    BeamWidth::Device => ("beams that have a width", "ideal rays"),
                    BeamWidth::Ideal => ("ideal rays", "beams that have a width"),
                };
                write!(
                    f,
                    "the scans are of {found}, and the rig says {said}: {:.0} % of three neighbouring ranges on the ground lie on a line (rays: 70 and more; \
                     scanners: 7 to 26); leaf areas are withheld; say `--optics {name}`, or `optics = \"{name}\"` in `[rig]`",
                    100.0 * exact
                )
            }
            Self::CalibratedOnRays => f.write_str(
                "the calibration was fitted on ideal rays: contact, voxel, polar and gap are corrected for the scanner's spot, the regression on I_T is \
                 withheld",
            ),
            Self::RemissionAssumed => f.write_str(
                "shares of spots are told by the curve that the scanner model assumes for remission: right for simulated scans; a real scanner needs a \
                 card (rig.scanner.remission with curve = \"card\")",
            ),
            Self::RemissionMissing { hits, read } => write!(
                f,
                "only {read} of {hits} hits have a remission: the leaf area is by contact; record with remission, or leave rig.scanner.remission out"
            ),
            Self::EchoUnknown => f.write_str(
                "nobody knows which echo the scans hold: the recording does not say it and this model may send the last one, the scanner refused to tell it, or \
                 it was changed on the way; leaf areas are withheld; where it is one echo, say which it was with --echo first, --echo last or the mount's echo",
            ),
            Self::ClassMismatch { key, expected, found } => {
                write!(f, "the calibration's {key} is {expected}, this is {found}")
            }
            Self::OutsideClass { key, expected, found, calibrated, relative_sd } => {
                let by = if *calibrated { "the calibration holds for" } else { "without calibration it is taken for" };
                write!(f, "{} is {found}, {by} {expected}", key.name())?;
                apart(f, *relative_sd)?;
                if *key == ClassKey::LineSpacing {
                    f.write_str("; fewer lines a voxel read higher, more of them lower; the rig's `speed_m_s` sets how large a voxel is: let it be the speed that was driven; between lost scans lines lie farther apart, too")?;
                }
                if *key == ClassKey::CrownDepth {
                    f.write_str("; narrower crowns read lower, deeper ones higher: a calibration of such crowns knows (`rowscan study calibration`)")?;
                }
                Ok(())
            }
            Self::ClassUnknown { keys, relative_sd } => {
                let names: Vec<&str> = keys.iter().map(|key| key.name()).collect();
                write!(f, "whether the leaf area holds for this row is not known: {}", names.join(", "))?;
                match relative_sd {
                    None if keys.contains(&ClassKey::WoodShare) => f.write_str(
                        "; wood counts as leaf, and a row without leaves is all wood: how far the leaf area is off is not known; `calibration` in the rig names one whose rows it is like, which knows their wood",
                    ),
                    _ => apart(f, *relative_sd),
                }
            }
            Self::OutsideFittedRange { estimator, value_m2_per_m, low_m2_per_m, high_m2_per_m, refused } => write!(
                f,
                "{estimator} was fitted on {low_m2_per_m:.3}..{high_m2_per_m:.3} m²/m, found {value_m2_per_m:.3}{}",
                if *refused { ": withheld" } else { "" }
            ),
            Self::TreesRefused { estimator, trees } => {
                let trees = plural((*trees).into(), "tree lies", "trees lie");
                write!(f, "{trees} far outside the range {estimator} was fitted on: withheld")
            }
            Self::MetresRefused { estimator, metres, of } => write!(
                f,
                "{metres} of {} of row lie far outside the range {estimator} was fitted on: withheld, and the others do not sum to the row",
                plural((*of).into(), "metre", "metres")
            ),
            Self::MostlyWood { leaf, by_class: true } => write!(
                f,
                "{:.0} % of the row's surface is leaf, by its class (`wood_share`): leaf areas are withheld, for so much wood is not told from leaves",
                leaf * 100.0
            ),
            Self::MostlyWood { leaf, by_class: false } => write!(
                f,
                "the calibration's rows have so much wood (`[contact.wood]`, else by `class.canopy.wood_share`) that {:.0} % of what was met here is left for leaves: leaf areas are withheld; is the row leafless, or another one than the calibration's?",
                leaf * 100.0
            ),
            Self::NoFoliage { share } => write!(
                f,
                "{:.0} % of the hits stand denser than any foliage (100 m² of leaves a m³), as on a wall or a sheet: leaf areas are withheld",
                100.0 * share
            ),
            Self::BehindStart { length_m } => write!(
                f,
                "{length_m:.2} m of row were passed in reverse, behind the first scan: lines count from there on ahead only, so start at the row's beginning"
            ),
            Self::GapsNotFilled { gaps, length_m } => {
                let gaps = plural(*gaps, "gap", "gaps");
                write!(f, "{gaps} in the scan lines, {length_m:.2} m of row not scanned")
            }
            Self::Restarts { restarts } => {
                write!(
                    f,
                    "{} of the device's clock or counter: how many scans were lost meanwhile, and the way driven, are unknown; the way goes by the \
                     speed before and the time that the host counted, where it counted one",
                    plural(*restarts, "restart or jump", "restarts or jumps")
                )
            }
            Self::NoDeviceClock { scans } => {
                let scans = plural(*scans, "scan", "scans");
                write!(f, "the device clock stood still for {scans}: timed by the nominal frequency")
            }
            Self::BrokenOff { place } => {
                write!(f, "the recording is {place}; the estimate is of the scans that can be read, however much of the row they show")
            }
            Self::StreamsLeftOut { read, left_out } => write!(
                f,
                "the recording holds scans of several streams and none was named: these are of `{read}`, the first by name; left out: {}; name one with \
                 FILE#STREAM",
                left_out.join(", ")
            ),
            Self::OtherRig { differences } => write!(
                f,
                "the recording was made with another rig than the given one, which decides: {}; expected the rig that the recording was made with",
                differences.join(", ")
            ),
            Self::OtherOptics { recorded, given, is_known } => {
                let (recorded, given) = (recorded.name(), given.name());
                match is_known {
                    true => write!(
                        f,
                        "an emulator made the recording with optics {recorded}, which decides; the rig says {given}; set the rig's `optics` to \"{recorded}\""
                    ),
                    false => write!(
                        f,
                        "the recording was kept with optics {recorded}, the rig says {given}, which decides; a real scanner's beams are `optics = \"device\"`"
                    ),
                }
            }
            Self::OtherEcho { told, given } => write!(
                f,
                "the scanner was set to send the {} echo, which decides; the rig or --echo says {}; set the mount's `echo` to \"{}\"",
                told.name(),
                given.name(),
                told.name()
            ),
            Self::Setting(note) => write!(f, "{note}"),
            Self::OtherModel { taken_for, found } => {
                let listed = |name: fn(AnyModel) -> &'static str| {
                    found.iter().copied().map(name).collect::<Vec<_>>().join(" or ")
                };
                write!(
                    f,
                    "the scanner is called {}, and is taken for the model {}, of which other things are known; expected --model {}",
                    listed(AnyModel::title),
                    taken_for.title(),
                    listed(AnyModel::name)
                )
            }
            Self::Unreadable { fault, telegrams } => {
                let telegrams = plural(*telegrams, "scan telegram", "scan telegrams");
                write!(f, "{telegrams} gave no scan ({}); of the first, {fault}", fault.code())
            }
            Self::Excluded { why: Exclusion::OtherLayer, scans } => {
                let scans = plural(*scans, "scan is of an inclined layer and was", "scans are of inclined layers and were");
                write!(f, "{scans} left out: the estimate is of the level layer (within 1°) alone, and is none where ScanLayerFilter or LFPlayerFilter switches that off")
            }
            Self::Excluded { why, scans } => {
                let scans = plural(*scans, "scan was", "scans were");
                write!(f, "{scans} left out: {}, {}", why.code(), why.reason())
            }
            Self::TurnsLeftOut { turns, of } => write!(
                f,
                "no scan came of {turns} of {} of the mirror, beyond the smallest output interval of the stream. Either a client changed that interval \
                 (LMDscandatacfg), or a virtual scanner's machine is too slow for real time: let that scanner run slower \
                 (--time-scale 0.5), or as fast as it can (--time-scale max)",
                plural(*of, "turn", "turns")
            ),
            Self::CountersContradict { scans } => write!(
                f,
                "in {} the counter of turns went on otherwise than the telegrams' counter and the device's clock: bits were changed on the way. CoLa A has no \
                 checksum that would tell, so ranges may be changed, too: take CoLa B, or mend the line",
                plural(*scans, "scan", "scans")
            ),
            Self::SegmentsLost { segments, share } => write!(
                f,
                "{} lost on the way, {:.1} % of all: nothing is known of their beams. Where scans came without them, impacted areas \
                 are too small by about as much, and leaf areas go by the beams that came; where it is the same segment of every scan, leaf areas are too small, \
                 too. Look for a slow network, a busy host, or a segment that nothing lets through",
                plural(*segments, "segment of a scan was", "segments of scans were"),
                100.0 * share
            ),
            Self::ContaminationWarning { scans } => {
                let scans = plural(*scans, "scan, which was", "scans, which were");
                write!(f, "the device warns of a dirty window in {scans} used: clean the window")
            }
            Self::OtherResolution { first_deg, other_deg, scans } => write!(
                f,
                "{} of another resolution than the first scan's {first_deg}°, as {other_deg}°: beams that differ are counted together; estimate each stretch by itself \
                 (`--scans`), or leave the scanner's mode as it is while it drives",
                plural(*scans, "scan used is", "scans used are")
            ),
            Self::LeftOn { setting, scans } => write!(
                f,
                "{}, in {}: areas and leaf areas are of what that left; scan again without it",
                setting.found,
                plural(*scans, "scan used", "scans used")
            ),
            Self::TooMuchExcluded { share, limit } => write!(
                f,
                "{:.1} % of the row has no valid scan, the rig's max_excluded allows {:.1} %: areas are withheld",
                share * 100.0,
                limit * 100.0
            ),
            Self::EncoderStood { lines } => write!(
                f,
                "the encoder stood still in all {}, so the rig's speed was taken; if the tractor stood, take --advance encoder",
                plural(*lines, "scan", "scans")
            ),
            Self::Stood { scans } => write!(
                f,
                "the tractor stood in all {}, so nothing was driven past and areas are unknown; if it drove, mend what its way is taken from, or take \
                 another source with --advance",
                plural(*scans, "scan", "scans")
            ),
            Self::UnknownBeams { share, limit } => write!(
                f,
                "{:.1} % of the beams that look at the row are unknown (no number, neither a hit nor a miss), the rig's max_excluded allows {:.1} %: areas are \
                 withheld",
                share * 100.0,
                limit * 100.0
            ),
            Self::EncoderStuck { scans, of } => write!(
                f,
                "by the encoder {scans} of {of} scans were taken where the scans before them were, or little farther, and they differ as places far apart do: it sticks or misses most of its ticks there (a bad contact), or counts too many elsewhere (a wheel that spins), and the way is \
                 wrong by that; mend it, or take --advance gnss, can or constant (in strong wind a tractor that stands can look so too)"
            ),
            Self::EncoderSpeed { encoder_m_s, rig_m_s } => {
                let remedy = "compare with --advance gnss or can; mend the encoder or correct encoder_ticks_per_m, or say with speed_m_s how fast it was";
                write!(
                    f,
                    "by the encoder the row was driven at {encoder_m_s:.2} m/s (half of the way faster, half slower), the rig says {rig_m_s} m/s: unless the tractor \
                     drove so, the encoder {}, and areas are wrong by that factor; {remedy}",
                    if encoder_m_s < rig_m_s {
                        "misses ticks or encoder_ticks_per_m is too large"
                    } else {
                        "counts too many or encoder_ticks_per_m is too small"
                    }
                )
            }
            Self::EncoderJumped { times } => write!(
                f,
                "the encoder's count jumped {} as no tractor drives (over 10 m/s), and the scanner went on: it was set anew, has fewer bits, or was \
                 read wrongly; the way of those turns is by the speed before",
                plural(*times, "time", "times")
            ),
            Self::SidesShifted { shift_m } => write!(
                f,
                "the pass from the other side fits better {:.2} m {} along the row: correct --other-start, --other-back or the way of one of both passes; joined so, \
                 leaves and air are mixed",
                shift_m.abs(),
                if *shift_m > 0.0 { "farther" } else { "less far" }
            ),
            Self::SidesApart => f.write_str(
                "the pass from the other side has no part of the row in common with this one, so nothing was joined: correct --other-start or --other-back",
            ),
            Self::SidesSame => f.write_str(
                "by its rig the other pass saw the row from the same side as this one: it shows little that was hidden, and an interval that it makes narrower is too narrow; \
                 name the recording from the other alley, or its rig with --other-rig",
            ),
            Self::WaysDiffer { way, way_m, beside, beside_m, apart_m } => {
                let other = if *beside == AdvanceSource::Can { "can" } else { "gnss" };
                write!(
                    f,
                    "the way by {} is {way_m:.2} m, and by the ground speed beside it ({}) {beside_m:.2} m, {apart_m:.2} m apart at most: a wheel slips, a lost speed was held while it changed, or `encoder_ticks_per_m`, the rig's speed or \
                     the ground speed is wrong. Areas and lengths are as wrong as the way; `--advance {other}` takes the other one",
                    way.name(),
                    beside.name()
                )
            }
            Self::ConstantSpeed { scans, speed_m_s, has_encoder } => {
                let none = if *has_encoder { "" } else { " (this scanner's model tells no encoder's count)" };
                write!(
                    f,
                    "the rig has an encoder (a scene's has one by default), and {} no reading of it{none}: the way is by the rig's constant {speed_m_s} m/s. If the tractor drove \
                     otherwise, take --advance gnss or can; ",
                    plural(*scans, "scan has", "scans have")
                )?;
                if *has_encoder {
                    f.write_str(
                        "or record anew with the encoder on: `rowscan estimate SCANNER --rig RIG --record FILE` sets it, `picoscan://HOST?encoder=on` asks for \
                         it; ",
                    )?;
                }
                f.write_str("if its speed was even, say so with --advance constant")
            }
            Self::NoEncoder { scans } => write!(
                f,
                "{} no reading of the encoder (the rig needs encoder_ticks_per_m, the scanner LICencset): areas are withheld",
                plural(*scans, "scan has", "scans have")
            ),
            Self::NothingValid => f.write_str("no valid scan came: areas are unknown"),
            Self::NoTime { scans } => write!(
                f,
                "{} without times, and nothing tells their rate: it is unknown, and with it the way; give it with --hertz",
                plural(*scans, "scan comes", "scans come")
            ),
            Self::SpeedHeld { seconds } => {
                write!(f, "the ground speed was lost for {seconds:.1} s; the last one known was held")
            }
            Self::OutOfSight { share } => write!(
                f,
                "no beam leads to {:.0} % of the row (of its room, the row spacing wide, up to the top that is looked at; or of the crown's height from below): leaf areas are withheld; compare the mount's `orientation`, `row`, `roof` and angles, \
                 and the scanner's field of view, with the machine",
                100.0 * share
            ),
            Self::GroundSilent { share } => write!(
                f,
                "of the beams that by the rig end on the ground before the row, {:.0} % met anything, and ground that is so near always answers: leaf areas are withheld; compare the mount's \
                 `roll_deg`, `orientation`, `roof` and `height_m` with the machine",
                100.0 * share
            ),
            Self::GroundUnmet { share } => write!(
                f,
                "by the rig beams lead to the ground of the alley, and {:.1} % of the returns lie there: leaf areas are withheld; compare the mount's `roll_deg`, `orientation`, \
                 `roof` and `height_m` with the machine",
                100.0 * share
            ),
            Self::TooFewBeams { share, voxel_m } => write!(
                f,
                "{:.0} % of the hits lie in voxels of {voxel_m} m that too few beams passed to tell a density: leaf areas are withheld; leave `voxel_edge_m` out, drive slower, or take a finer resolution",
                100.0 * share
            ),
            Self::TooManyLeaves { lai } if !lai.is_finite() => f.write_str(
                "what was met from the other side stands where this pass met no canopy: leaf areas are withheld; compare the rigs, `alley` and the starts of both passes",
            ),
            Self::TooManyLeaves { lai } => write!(
                f,
                "what was met comes to a leaf area index of {lai:.0}, more than any orchard has: leaf areas are withheld; compare the mount's `roll_deg`, `height_m`, `distance_m` and angles, and the rig's \
                 `row_spacing_m`, with the machine"
            ),
            Self::MostlyUnseen { share } => write!(
                f,
                "too few beams reached {:.0} % of the row's voxels, behind what was met or between beams and lines that lie far apart, and what they hold could only be guessed: leaf areas are withheld; measure from both sides \
                 (`--other-side`), slower or at a finer resolution, and compare the mount's `roll_deg`, `height_m` and angles with the machine",
                100.0 * share
            ),
            Self::CanopyAtScanner { share, distance_m } => write!(
                f,
                "{:.0} % of the canopy's returns lie within {NEAR_SCANNER_M} m of the scanner's way: it was driven through the crowns, where leaves before the mirror hide all others, so leaf areas are withheld; \
                 drive farther from the row, or measure `distance_m`, {distance_m} m, again",
                100.0 * share
            ),
            Self::StoodStill { share, withheld, by } => {
                let way = by.unwrap_or_default().name();
                write!(
                    f,
                    "{:.0} % of the scans that tell it are of one place, and the way by {way} goes on between them: one stretch counts many times{}; leave out the scans of a tractor that stands, or \
                     take the way from what tells the stand (an encoder, --gnss, --can)",
                    100.0 * share,
                    if *withheld { ", and leaf areas are withheld" } else { "" }
                )
            }
            Self::InTheAir { shares: [near, behind], withheld } => {
                write!(
                    f,
                    "{:.1} % of the canopy's returns lie within {NEAR_SCANNER_M} m of the scanner's way, and most of them are nearer or farther than those of both neighbouring beams, as rain, snow, fog and dust \
                     return them; behind that, to {BESIDE_SCANNER_M} m, these make {:.1} %: ",
                    100.0 * near,
                    100.0 * behind
                )?;
                f.write_str(match withheld {
                    true => "leaf areas are withheld; heights, volumes and impacted areas count them, too; scan again in clear air",
                    false => "they count as leaves, and leaf areas read up to 10 % more than in clear air; scan again in clear air to be sure",
                })
            }
            Self::RidesAlong { share, length_m, distance_m } => write!(
                f,
                "{:.1} % of the canopy's returns lie within {BESIDE_SCANNER_M} m of the scanner's way, in each line along {length_m:.1} m of row, and the row's axis is {distance_m} m away: spray before the scanner, a part of the \
                 machine in its beams, or tall growth so near counts as the row's leaves, so leaf areas are withheld; mount the scanner ahead of the nozzles and clear of the machine, and scan with the nozzles shut; if crowns reach so near, drive farther from the row",
                100.0 * share
            ),
            Self::RowElsewhere { near_m, far_m, distance_m } => {
                let place = |behind_m: f64| {
                    let side = if behind_m > 0.0 { "behind" } else { "before" };
                    format!("{:.2} m {side}", behind_m.abs())
                };
                write!(
                    f,
                    "the canopy lies from {} to {} the axis on which the rig has the row, {distance_m} m from the scanner, and what is hidden is taken for its mirror image about that axis: leaf areas are withheld; \
                     measure `distance_m` again (the middle of what was met is at {:.2} m, and the axis there or somewhat behind it), and compare the mount's `roof`, `row` and angles with the machine; a row that stands there may be so dense that its far half is not seen, or lean over to one side",
                    place(*near_m),
                    place(*far_m),
                    distance_m + 0.5 * (near_m + far_m)
                )
            }
            Self::VoxelEdge { edge_m, calibrated_m, relative_sd } => {
                write!(f, "the calibration was fitted in voxels of {calibrated_m} m, and this row is measured in voxels of {edge_m} m: ")?;
                match relative_sd {
                    Some(sd) => write!(f, "the leaf area may be off by {:.0} % (standard deviation)", 100.0 * sd)?,
                    None => f.write_str("leaf areas are withheld")?,
                }
                write!(f, "; leave `voxel_edge_m` out, give it as {calibrated_m}, or fit a calibration with this rig")
            }
            Self::GroundAsCanopy { share, z_m } => write!(
                f,
                "{:.0} % of the returns that count as canopy lie level {z_m:.1} m above where the rig puts the ground, as ground does: leaf areas are withheld; compare the mount's `height_m`, `roof` and angles with the machine, or raise `ground_clearance_m` above grass and weeds",
                100.0 * share
            ),
            Self::GroundSlope { found_deg, told_deg, withheld } => write!(
                f,
                "the ground has a slope of {found_deg:.1}° (positive: it rises to the tractor's right), the rig says {told_deg:.1}°: ground counts as leaves on one side of \
                 the row, and leaves as ground on the other{}; set the rig's `ground_slope_deg` (an alley driven back has the other sign), or, if the rig tells the ground's slope, correct the mount's `roll_deg`",
                if *withheld { ", and leaf areas are withheld" } else { "" }
            ),
            Self::GroundLevel { level_m, clearance_m, withheld } => write!(
                f,
                "the ground, or what covers it, lies {:.2} m {} where the rig puts it, with a ground_clearance_m of {clearance_m}: {}{}; correct the mount's `height_m` \
                 or angles{}",
                level_m.abs(),
                if *level_m > 0.0 { "above" } else { "below" },
                if *level_m > 0.0 { "what stands out of that counts as leaves" } else { "heights are too low by as much, and low leaves are taken for ground" },
                if *withheld { ", and leaf areas are withheld" } else { "" },
                if *level_m > 0.0 { ", or raise `ground_clearance_m` above grass and weeds" } else { "" }
            ),
            Self::Clearance { share, clearance_m } => write!(
                f,
                "{:.0} % of the returns from {GRASS_M} m above the ground on lie below the rig's ground_clearance_m, {clearance_m} m, and count as ground: leaves there are in no leaf area, nor in its interval; \
                 lower `ground_clearance_m` unless they are weeds",
                100.0 * share
            ),
            Self::BelowGround { share } => write!(
                f,
                "{:.0} % of the returns before the row lie more than {FAR_BELOW_M} m below where the rig puts the ground, and nothing returns from there: leaf areas are withheld; correct the \
                 mount's `roll_deg` or `height_m`, or, where the ground slopes, the rig's `ground_slope_deg`",
                100.0 * share
            ),
            Self::GrowthInAlley { share, clearance_m } => write!(
                f,
                "{:.0} % of the returns that count as canopy stand low in the alley, before the crowns, as grass, weeds and rough soil do, and shoots that a strong wind blows there: they count as leaves, and an interval, where one is told, reaches down to what it would be \
                 without them; mow, or raise `ground_clearance_m`, {clearance_m} m, above them",
                100.0 * share
            ),
            Self::BeforeRow { before_m } => write!(
                f,
                "{before_m:.1} m before the row's start were scanned and count in the totals, and in no tree; a virtual orchard repeats its row, so its last trees \
                 are measured there: start at `start_m` 0; with `yaw_deg` or `pitch_deg` the beams meet the row elsewhere than beside the tractor, so start as much farther on"
            ),
            Self::PastRow { row_m, past_m } => write!(
                f,
                "{past_m:.1} m behind the row's end at {row_m:.1} m were scanned and count in the totals; a virtual orchard repeats its row where the \
                 drive does not turn, so its first trees are measured again: end with --length {row_m:.1}, or give the rig the trees that stand there; with `yaw_deg` or `pitch_deg` the beams \
                 meet the row elsewhere than beside the tractor, so end as much earlier"
            ),
            Self::TooManyCells { kept } => {
                write!(f, "only the first {kept} trees and slices are listed; the totals hold all")
            }
            Self::TooFewBlocks { blocks, expected } => write!(
                f,
                "the scans hold {} of 2 m of row, and it takes {expected} to tell how sure a leaf area is: the row has no interval, nor have bands of \
                 height; scan a longer row",
                plural(*blocks as u64, "piece", "pieces")
            ),
        }
    }
}

/// How far classes are apart, in words.
fn apart(f: &mut fmt::Formatter<'_>, relative_sd: Option<f64>) -> fmt::Result {
    // Where one of the classes has no leaves, no share tells it.
    match relative_sd.filter(|sd| sd.is_finite()) {
        Some(sd) => write!(f, "; such classes are {:.0} % apart (standard deviation)", 100.0 * sd),
        None => f.write_str("; how far such classes are apart was not measured"),
    }
}
