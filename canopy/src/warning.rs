//! What a reader of an estimate must know beside its numbers.

use std::fmt;

use rowscan_protocol::model::AnyModel;
use rowscan_protocol::validity::ScanFault;
use serde::{Serialize, Serializer};

use crate::card_law::CardMisfit;
use crate::class::ClassKey;
use crate::gate::Exclusion;
use crate::remission::RemissionScale;

/// What a reader of an estimate must know beside its numbers. Serialises as its text, which begins with its [`code`](Warning::code).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// No calibration gives the contact scale: the leaf area is the raw contact frequency, wood included.
    Uncalibrated,
    /// The rig knows no row spacing: the far row is not removed.
    NoFarRowGate,
    /// The rig does not say how wide the scanner's beams are: leaf areas are withheld.
    OpticsUnknown,
    /// The calibration was fitted on ideal rays, and these are the beams of a device: contact is corrected for the spot, I_T is not.
    CalibratedOnRays,
    /// The beams have a width, and nobody knows which echo the scans hold: leaf areas are withheld.
    EchoUnknown,
    /// The calibration's regression on I_T tells too little of what rows differ by: it is withheld.
    WeakRegression {
        /// Share of what rows differ by that it tells, of rows that were not fitted.
        r2: f64,
    },
    /// Shares of spots and contact agree otherwise than on the calibration's rows: the leaf area is by contact.
    SharesDisagree {
        /// Raw leaf area by shares over that by contact.
        ratio: f64,
        /// What 99 of 100 rows of the calibration have.
        band: [f64; 2],
    },
    /// The calibration does not say how shares of spots and contact agree: the leaf area is by contact.
    NoWitness,
    /// The card was measured at too few ranges: the leaf area is by contact.
    CardTooShort,
    /// Other cards refute that remission goes by the logarithm of power: the leaf area is by contact.
    CardLaw {
        /// How far they are off each law.
        misfit: CardMisfit,
    },
    /// What remission means is assumed.
    RemissionAssumed,
    /// The rig says how remission is read, and too few hits have one: leaf areas are not by shares of spots.
    RemissionMissing {
        /// Hits.
        hits: u64,
        /// Hits with remission.
        read: u64,
    },
    /// The calibration's class says otherwise than the rig or the scans.
    ClassMismatch {
        /// The class's key.
        key: &'static str,
        /// What the calibration was fitted on.
        expected: String,
        /// What is scanned.
        found: String,
    },
    /// The row is described as another canopy than the one that the leaf area holds for: the calibration's class, or without calibration what the
    /// contact frequency assumes.
    OutsideClass {
        /// The property.
        key: ClassKey,
        /// What the leaf area holds for.
        expected: String,
        /// What the row is.
        found: String,
        /// True if a calibration says what is expected.
        calibrated: bool,
        /// How far classes that differ in it are apart, relative standard deviation; `None` where no study measured it.
        relative_sd: Option<f64>,
    },
    /// Whether the row is of the class that the leaf area holds for is not known in these properties.
    ClassUnknown {
        /// The properties.
        keys: Vec<ClassKey>,
        /// What classes that differ in all of them are apart, relative standard deviation; `None` where no study measured one of them.
        relative_sd: Option<f64>,
    },
    /// The row lies outside the range the calibration was fitted on.
    OutsideFittedRange {
        /// Estimator: `linear`, `power` or `contact`.
        estimator: &'static str,
        /// The row's value per metre of row, m²/m.
        value_m2_per_m: f64,
        /// Smallest fitted value.
        low_m2_per_m: f64,
        /// Largest fitted value.
        high_m2_per_m: f64,
        /// True if so far outside that the estimate is withheld.
        refused: bool,
    },
    /// Trees whose own value lies so far outside the fitted range that it is withheld.
    TreesRefused {
        /// Estimator: `linear`, `power` or `contact`.
        estimator: &'static str,
        /// How many.
        trees: u32,
    },
    /// Much of what was hit is denser than any foliage, as a wall or a sheet: leaf areas are withheld.
    NoFoliage {
        /// Share of the hits.
        share: f64,
    },
    /// The row before the first scan was passed in reverse: it is not measured.
    BehindStart {
        /// Metres of it.
        length_m: f64,
    },
    /// Gaps longer than the longest one filled: so much of the row was not scanned.
    GapsNotFilled {
        /// How many.
        gaps: u64,
        /// Metres of row left out.
        length_m: f64,
    },
    /// The device restarted, or its clock or counter jumped: the way driven meanwhile is unknown.
    Restarts {
        /// How many.
        restarts: u64,
    },
    /// The device clock stood still while telegrams were counted: the nominal frequency stood in for it.
    NoDeviceClock {
        /// Turns so timed.
        scans: u64,
    },
    /// The scanner made no telegram of turns of its mirror, as a virtual one does whose host is too slow.
    TurnsLeftOut {
        /// How many.
        turns: u64,
        /// Of so many.
        of: u64,
    },
    /// Parts of scans were lost on their way.
    SegmentsLost {
        /// How many.
        segments: u64,
        /// Share of all beams of which nothing is known.
        share: f64,
    },
    /// The recording breaks off: what came behind is not in the estimate.
    BrokenOff {
        /// Where, and what is there.
        place: String,
    },
    /// The scanner, or its recording, names another model than the one that it is taken for.
    OtherModel {
        /// The model that it is taken for.
        taken_for: AnyModel,
        /// The models that it can be.
        found: Vec<AnyModel>,
    },
    /// Scan telegrams that passed their checksum and gave no scan.
    Unreadable {
        /// The first one's fault.
        fault: ScanFault,
        /// How many had one of this kind.
        telegrams: u64,
    },
    /// Scans that were left out.
    Excluded {
        /// Why.
        why: Exclusion,
        /// How many.
        scans: u64,
    },
    /// Scans that were used although the device warned of a dirty window.
    ContaminationWarning {
        /// How many.
        scans: u64,
    },
    /// More of the row than the rig's `max_excluded` has no valid scan: areas are withheld.
    TooMuchExcluded {
        /// Share of the row.
        share: f64,
        /// The rig's limit.
        limit: f64,
    },
    /// No valid scan came: areas are unknown.
    NothingValid,
    /// The encoder never counted: the rig's speed was taken instead.
    EncoderStood {
        /// Scans in which it stood.
        lines: u64,
    },
    /// The encoder's count fell as no tractor goes back, while the scanner went on: the speed before was held.
    EncoderFell {
        /// So often.
        times: u64,
    },
    /// The rig has an encoder, and scans had no reading of it: the rig's speed was taken.
    ConstantSpeed {
        /// So many of them.
        scans: u64,
        /// The rig's speed, m/s.
        speed_m_s: f64,
        /// The scanner's model can tell what an encoder counts.
        has_encoder: bool,
    },
    /// The advance was to be taken from the encoder alone, and scans had no reading of it: areas are withheld.
    NoEncoder {
        /// So many of them.
        scans: u64,
    },
    /// Neither clock nor frequency tells how long scans took: areas are withheld, unless an encoder tells the way.
    NoTime {
        /// So many of them.
        scans: u64,
    },
    /// The measured ground speed was lost: the last one known was held.
    SpeedHeld {
        /// For so long, seconds.
        seconds: f64,
    },
    /// Lines went on behind the row's last tree: what stands there counts in the totals.
    PastRow {
        /// Length of the row, metres.
        row_m: f64,
        /// Metres behind its end.
        past_m: f64,
    },
    /// More trees or slices than are kept: the later ones count in the totals only.
    TooManyCells {
        /// Kept at most.
        kept: usize,
    },
}

impl Warning {
    /// Where a scanner that can be any of the models `found` is taken for another; `None` where none of them is modelled.
    pub fn other_model(found: &[AnyModel], taken_for: AnyModel) -> Option<Self> {
        let is_another = !found.is_empty() && !found.contains(&taken_for);
        is_another.then(|| Self::OtherModel { taken_for, found: found.to_vec() })
    }

    /// One word to branch on.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Uncalibrated => "uncalibrated",
            Self::NoFarRowGate => "no_far_row_gate",
            Self::OpticsUnknown => "optics_unknown",
            Self::WeakRegression { .. } => "weak_regression",
            Self::SharesDisagree { .. } => "shares_disagree",
            Self::NoWitness => "no_witness",
            Self::CardTooShort => "card_too_short",
            Self::CardLaw { .. } => "card_law",
            Self::CalibratedOnRays => "calibrated_on_rays",
            Self::EchoUnknown => "echo_unknown",
            Self::RemissionAssumed => "remission_assumed",
            Self::RemissionMissing { .. } => "remission_missing",
            Self::ClassMismatch { .. } => "class_mismatch",
            Self::OutsideClass { .. } => "class",
            Self::ClassUnknown { .. } => "class_unknown",
            Self::OutsideFittedRange { refused: false, .. } => "outside_fitted_range",
            Self::OutsideFittedRange { refused: true, .. } => "refused",
            Self::TreesRefused { .. } => "trees_refused",
            Self::NoFoliage { .. } => "no_foliage",
            Self::BehindStart { .. } => "behind_start",
            Self::GapsNotFilled { .. } => "gaps_not_filled",
            Self::Restarts { .. } => "restarts",
            Self::NoDeviceClock { .. } => "no_device_clock",
            Self::TurnsLeftOut { .. } => "turns_left_out",
            Self::SegmentsLost { .. } => "segments_lost",
            Self::BrokenOff { .. } => "broken_off",
            Self::OtherModel { .. } => "other_model",
            Self::Unreadable { .. } => "unreadable",
            Self::Excluded { why: Exclusion::OtherLayer, .. } => "other_layer",
            Self::Excluded { .. } => "excluded",
            Self::ContaminationWarning { .. } => "contamination_warning",
            Self::TooMuchExcluded { .. } => "too_much_excluded",
            Self::NothingValid => "nothing_valid",
            Self::EncoderStood { .. } => "encoder_stood",
            Self::EncoderFell { .. } => "encoder_fell",
            Self::ConstantSpeed { .. } => "constant_speed",
            Self::NoEncoder { .. } => "no_encoder",
            Self::NoTime { .. } => "no_time",
            Self::SpeedHeld { .. } => "speed_held",
            Self::PastRow { .. } => "past_row",
            Self::TooManyCells { .. } => "too_many_cells",
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.code())?;
        match self {
            Self::Uncalibrated => {
                f.write_str("leaf area is the raw contact frequency, wood included; name a calibration in the rig")
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
                "the recording does not say which echo its scans hold, and this model may send the last one: leaf areas are withheld; say which it was \
                 with --echo first, --echo last or the mount's echo",
            ),
            Self::ClassMismatch { key, expected, found } => {
                write!(f, "the calibration's {key} is {expected}, this is {found}")
            }
            Self::OutsideClass { key, expected, found, calibrated, relative_sd } => {
                let by = if *calibrated { "the calibration holds for" } else { "without calibration it is taken for" };
                write!(f, "{} is {found}, {by} {expected}", key.name())?;
                apart(f, *relative_sd)
            }
            Self::ClassUnknown { keys, relative_sd } => {
                let names: Vec<&str> = keys.iter().map(|key| key.name()).collect();
                write!(f, "whether the leaf area holds for this row is not known: {}", names.join(", "))?;
                apart(f, *relative_sd)
            }
            Self::OutsideFittedRange { estimator, value_m2_per_m, low_m2_per_m, high_m2_per_m, refused } => write!(
                f,
                "{estimator} was fitted on {low_m2_per_m:.3}..{high_m2_per_m:.3} m²/m, found {value_m2_per_m:.3}{}",
                if *refused { ": withheld" } else { "" }
            ),
            Self::TreesRefused { estimator, trees } => {
                write!(f, "{trees} trees lie far outside the range {estimator} was fitted on: withheld")
            }
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
                write!(f, "{gaps} gaps in the scan lines, {length_m:.2} m of row not scanned")
            }
            Self::Restarts { restarts } => {
                write!(f, "{restarts} restarts or jumps of the device's clock or counter; the way driven meanwhile is unknown")
            }
            Self::NoDeviceClock { scans } => {
                write!(f, "the device clock stood still for {scans} scans; they are timed by the nominal frequency")
            }
            Self::BrokenOff { place } => {
                write!(f, "the recording is {place}; the estimate is of the scans that can be read, however much of the row they show")
            }
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
                write!(f, "{telegrams} scan telegrams gave no scan ({}); of the first, {fault}", fault.code())
            }
            Self::Excluded { why: Exclusion::OtherLayer, scans } => {
                write!(f, "{scans} scans are of inclined layers and were left out: the estimate is of the level layer (within 1°) alone, and is none where ScanLayerFilter or LFPlayerFilter switches that off")
            }
            Self::Excluded { why, scans } => write!(f, "{scans} scans were left out: {}, {}", why.code(), why.reason()),
            Self::TurnsLeftOut { turns, of } => write!(
                f,
                "the scanner left out {turns} of {of} turns of its mirror; a virtual scanner does so where its machine is too slow for real time: let it run \
                 slower (--time-scale 0.5), or as fast as it can (--time-scale max)"
            ),
            // What never came has no beams that could be counted.
            Self::SegmentsLost { segments, share } if *share == 0.0 => write!(
                f,
                "{segments} segments of scans were lost on their way, the same ones of every scan: how many beams they held is not known; areas are too small; look \
                 for a slow network, a busy host, or a filter in the scanner"
            ),
            Self::SegmentsLost { segments, share } => write!(
                f,
                "{segments} segments of scans were lost on their way; of {:.1} % of all beams nothing is known: impacted areas are too small by about that, leaf areas \
                 go by the beams that came; look for a slow network or a busy host",
                100.0 * share
            ),
            Self::ContaminationWarning { scans } => {
                write!(f, "the device warns of a dirty window in {scans} scans; they were used: clean the window")
            }
            Self::TooMuchExcluded { share, limit } => write!(
                f,
                "{:.1} % of the row has no valid scan, the rig's max_excluded allows {:.1} %: areas are withheld",
                share * 100.0,
                limit * 100.0
            ),
            Self::EncoderStood { lines } => write!(
                f,
                "the encoder stood still in all {lines} scans, so the rig's speed was taken; if the tractor stood, take --advance encoder"
            ),
            Self::EncoderFell { times } => write!(
                f,
                "the encoder's count fell {times} times as no tractor goes back, and the scanner went on: it was set anew, or has fewer bits; the way of \
                 those turns is by the speed before"
            ),
            Self::ConstantSpeed { scans, speed_m_s, has_encoder } => {
                write!(
                    f,
                    "the rig has an encoder, and {scans} scans have no reading of it: the way is by the rig's constant {speed_m_s} m/s. If the tractor drove \
                     otherwise, take --advance gnss or can; "
                )?;
                f.write_str(match has_encoder {
                    true => {
                        "or record anew with the encoder on: `rowscan estimate SCANNER --rig RIG --record FILE` sets it, `picoscan://HOST?encoder=on` asks for \
                         it; "
                    }
                    false => "this scanner's model tells no encoder's count; ",
                })?;
                f.write_str("if its speed was even, say so with --advance constant")
            }
            Self::NoEncoder { scans } => write!(
                f,
                "{scans} scans have no reading of the encoder (the rig needs encoder_ticks_per_m, the scanner LICencset): areas are withheld"
            ),
            Self::NothingValid => f.write_str("no valid scan came: areas are unknown"),
            Self::NoTime { scans } => write!(
                f,
                "{scans} scans come without times, and nothing tells their rate: it is unknown, and with it the way; give it with --hertz"
            ),
            Self::SpeedHeld { seconds } => {
                write!(f, "the ground speed was lost for {seconds:.1} s; the last one known was held")
            }
            Self::PastRow { row_m, past_m } => write!(
                f,
                "{past_m:.1} m behind the row's end at {row_m:.1} m were scanned and count in the totals; a virtual orchard repeats its row, so its first \
                 trees are measured again: end with --length {row_m:.1}, or give the rig the trees that stand there"
            ),
            Self::TooManyCells { kept } => {
                write!(f, "only the first {kept} trees and slices are listed; the totals hold all")
            }
        }
    }
}

/// How far classes are apart, in words.
fn apart(f: &mut fmt::Formatter<'_>, relative_sd: Option<f64>) -> fmt::Result {
    match relative_sd {
        Some(sd) => write!(f, "; such classes are {:.0} % apart (standard deviation)", 100.0 * sd),
        None => f.write_str("; how far such classes are apart was not measured"),
    }
}

impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
