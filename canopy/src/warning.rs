//! What a reader of an estimate must know beside its numbers.

mod code;
mod words;

use rowscan_protocol::host::SettingNote;
use rowscan_protocol::leftover::Leftover;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{BeamWidth, EchoChoice};
use rowscan_protocol::validity::ScanFault;
use serde::{Serialize, Serializer};

use crate::card_law::CardMisfit;
use crate::class::ClassKey;
use crate::gate::Exclusion;
use crate::odometry::AdvanceSource;

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
    /// The scans are of other beams than the rig says: leaf areas are withheld.
    OtherBeams {
        /// What they look like.
        found: BeamWidth,
        /// Share of three neighbouring ranges on the ground that lie on a line.
        exact: f64,
    },
    /// The calibration was fitted on ideal rays, and these are the beams of a device: contact is corrected for the spot, I_T is not.
    CalibratedOnRays,
    /// The beams have a width, and nobody knows which echo the scans hold: leaf areas are withheld.
    EchoUnknown,
    /// The calibration's regression on I_T tells too little of what rows differ by: it is withheld.
    WeakRegression {
        /// Share of what rows differ by that it tells, of rows that were not fitted.
        r2: f64,
    },
    /// The calibration's regression on I_T is of rows that are seen from elsewhere: it is withheld.
    OtherMount {
        /// How far off their axes were, metres.
        distance_m: Option<f64>,
        /// How high above the ground their scanner was, metres.
        height_m: Option<f64>,
        /// Its yaw and pitch, degrees; 0 where it was upright.
        turned_deg: [f64; 2],
    },
    /// The calibration's regression on I_T is of rows whose trees stand farther apart, or nearer: it is withheld.
    OtherSpacing {
        /// From tree to tree of these, metres.
        calibrated_m: f64,
        /// By the rig, metres.
        spacing_m: f64,
    },
    /// Trees differ by too much for the calibration's regression on I_T, which is one of rows: it is withheld.
    UnevenTrees {
        /// What it tells tree by tree over what it tells of the row.
        ratio: f64,
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
    /// Metres of row whose own value lies so far outside the fitted range that it is withheld: those that are told do not sum to the row.
    MetresRefused {
        /// Estimator: `linear`, `power` or `contact`.
        estimator: &'static str,
        /// How many.
        metres: u32,
        /// Of so many.
        of: u32,
    },
    /// Much of what was hit is denser than any foliage, as a wall or a sheet: leaf areas are withheld.
    NoFoliage {
        /// Share of the hits.
        share: f64,
    },
    /// Most of what was met is wood, as rows of the calibration have it or by the row's class: leaf areas are withheld.
    MostlyWood {
        /// Share of the raw leaf area that is leaf.
        leaf: f64,
        /// Whether the row's class says so.
        by_class: bool,
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
    /// The counter of turns contradicts the counter of telegrams and the device's clock.
    CountersContradict {
        /// In so many scans.
        scans: u64,
    },
    /// Parts of scans were lost on their way.
    SegmentsLost {
        /// How many.
        segments: u64,
        /// Share of all segments, from the first to the last one that came.
        share: f64,
    },
    /// The recording breaks off: what came behind is not in the estimate.
    BrokenOff {
        /// Where, and what is there.
        place: String,
    },
    /// The recording holds several streams of scans, and none was named.
    StreamsLeftOut {
        /// The stream that was read.
        read: String,
        /// The others.
        left_out: Vec<String>,
    },
    /// The recording was made with another rig than the one that it is measured by.
    OtherRig {
        /// The keys that differ, as recorded and as given.
        differences: Vec<String>,
    },
    /// The recording was made with beams of another width than the rig says.
    OtherOptics {
        /// As the recording says.
        recorded: BeamWidth,
        /// As the rig says.
        given: BeamWidth,
        /// An emulator made the recording, and knows: its word holds. Of a real scanner the rig's does.
        is_known: bool,
    },
    /// The scanner was set to send another echo than the rig says.
    OtherEcho {
        /// As the scanner was set.
        told: EchoChoice,
        /// As the rig says.
        given: EchoChoice,
    },
    /// A setting of the scanner is not as it was to be, or was found as another client had left it.
    Setting(SettingNote),
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
    /// Scans of several resolutions were used together.
    OtherResolution {
        /// Angle between beams of the first scan, degrees.
        first_deg: f64,
        /// The first other one, degrees.
        other_deg: f64,
        /// Scans of another one than the first.
        scans: u64,
    },
    /// Scans that were used although a setting of the device took something from them, as the recording tells.
    LeftOn {
        /// Which setting.
        setting: &'static Leftover,
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
    /// The tractor stood in all scans: nothing was driven past.
    Stood {
        /// So many.
        scans: u64,
    },
    /// Beams that look at the row have no range that could be known: areas are withheld.
    UnknownBeams {
        /// Share of them, by the way.
        share: f64,
        /// The rig's limit.
        limit: f64,
    },
    /// The encoder stood while scans changed as they do when the tractor drives.
    EncoderStuck {
        /// Scans in which it did.
        scans: u64,
        /// Of so many.
        of: u64,
    },
    /// The speed by the encoder is far off the rig's.
    EncoderSpeed {
        /// By the encoder, at which half the way was driven, m/s.
        encoder_m_s: f64,
        /// The rig's, m/s.
        rig_m_s: f64,
    },
    /// The encoder's count jumped as no tractor drives, while the scanner went on: the speed before was held.
    EncoderJumped {
        /// So often.
        times: u64,
    },
    /// A pass from the row's other side fits better where it lies farther along the row.
    SidesShifted {
        /// So much farther, metres.
        shift_m: f64,
    },
    /// A pass from the row's other side has no slice in common with this one.
    SidesApart,
    /// Another pass saw the row from the same side as this one.
    SidesSame,
    /// The ground lies higher or lower than the rig has it.
    GroundLevel {
        /// How much higher, at the row axis, metres.
        level_m: f64,
        /// The rig's clearance above the ground, metres.
        clearance_m: f64,
        /// It lies so far below that leaf areas are withheld.
        withheld: bool,
    },
    /// The rig's clearance takes returns above grass for ground.
    Clearance {
        /// Share of all returns above grass.
        share: f64,
        /// The clearance, metres.
        clearance_m: f64,
    },
    /// Grass, weeds or soil in the alley stand out of the rig's clearance and count as leaves.
    GrowthInAlley {
        /// Share of the canopy's returns.
        share: f64,
        /// The clearance, metres.
        clearance_m: f64,
    },
    /// So many returns lie far below where the rig has the ground that it has the scanner wrong: leaf areas are withheld.
    BelowGround {
        /// Share of the returns.
        share: f64,
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
    /// A ground speed that was measured beside the way of the estimate tells another way.
    WaysDiffer {
        /// What the estimate goes by.
        way: AdvanceSource,
        /// How far it came by that while the speed was known, metres.
        way_m: f64,
        /// What measured the speed.
        beside: AdvanceSource,
        /// How far it came by that, metres.
        beside_m: f64,
        /// How far both were apart at most, metres.
        apart_m: f64,
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
    /// Of what counts as canopy much lies level, and the ground that the rig tells was not met: its height, roof or leaning is off by all appearance.
    GroundAsCanopy {
        /// Share of the canopy's returns.
        share: f64,
        /// Where they lie above the ground that the rig tells, metres.
        z_m: f64,
    },
    /// No beam leads to most of the row: leaf areas are withheld.
    OutOfSight {
        /// Share of the row's room.
        share: f64,
    },
    /// Beams that the rig leads to the ground before the row met nothing: leaf areas are withheld.
    GroundSilent {
        /// Share of them that met something.
        share: f64,
    },
    /// Next to no return lies where the rig puts the ground, though it leads beams to the alley: leaf areas are withheld.
    GroundUnmet {
        /// Share of the returns that do.
        share: f64,
    },
    /// Too few beams passed most of the voxels that were hit: leaf areas are withheld.
    TooFewBeams {
        /// Share of the hits in such voxels.
        share: f64,
        /// Edge of the voxels, metres.
        voxel_m: f64,
    },
    /// More was met than any orchard has leaves: leaf areas are withheld.
    TooManyLeaves {
        /// Leaf area index of all that was met.
        lai: f64,
    },
    /// Too few beams reached half of the row: leaf areas are withheld.
    MostlyUnseen {
        /// Share of its voxels that too few beams reached.
        share: f64,
    },
    /// Much of the canopy lies where the scanner was driven: leaf areas are withheld.
    CanopyAtScanner {
        /// Share of its returns there.
        share: f64,
        /// How far the axis is from the mirror by the rig, metres.
        distance_m: f64,
    },
    /// Scans are of one place, and the way goes on between them: the tractor stood.
    StoodStill {
        /// Share of the row, by the way.
        share: f64,
        /// Whether leaf areas are withheld for it.
        withheld: bool,
        /// What the way is by.
        by: Option<AdvanceSource>,
    },
    /// Rain, snow, fog or dust returned beams before they reached the row.
    InTheAir {
        /// Share of the canopy's returns that it makes close to the scanner's way, and behind that as deep again: by the second leaf areas are withheld.
        shares: [f64; 2],
        /// Whether leaf areas are withheld for it.
        withheld: bool,
    },
    /// Something that rides with the scanner returned its beams before they reached the row: leaf areas are withheld.
    RidesAlong {
        /// Share of the canopy's returns that lie close to the scanner's way.
        share: f64,
        /// Length of row along which each line has returns there, metres.
        length_m: f64,
        /// How far the axis is from the mirror by the rig, metres.
        distance_m: f64,
    },
    /// The canopy does not stand about the rig's row axis: leaf areas are withheld.
    RowElsewhere {
        /// Where its near face lies, metres behind the axis; less than 0 before it.
        near_m: f64,
        /// The same of its far face.
        far_m: f64,
        /// How far the axis is from the mirror by the rig, metres.
        distance_m: f64,
    },
    /// Contact is measured in voxels of another edge than the calibration's.
    VoxelEdge {
        /// Of this row, metres.
        edge_m: f64,
        /// Of the rows that were fitted, metres.
        calibrated_m: f64,
        /// By which the interval is wider for it; `None` where leaf areas are withheld.
        relative_sd: Option<f64>,
    },
    /// The ground rises otherwise than the rig says.
    GroundSlope {
        /// As its returns lie, degrees; positive where it rises to the tractor's right.
        found_deg: f64,
        /// The rig's.
        told_deg: f64,
        /// True if so far off that leaf areas are withheld.
        withheld: bool,
    },
    /// Lines began before the row's first tree: what stands there counts in the totals.
    BeforeRow {
        /// Metres before its start.
        before_m: f64,
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
    /// The row is too short for its pieces to tell how sure its leaf area, or the bands of a profile, are: they have no interval.
    TooFewBlocks {
        /// Pieces of the row.
        blocks: usize,
        /// The fewest that tell it.
        expected: usize,
    },
}

impl Warning {
    /// Where a scanner that can be any of the models `found` is taken for another; `None` where none of them is modelled.
    pub fn other_model(found: &[AnyModel], taken_for: AnyModel) -> Option<Self> {
        let is_another = !found.is_empty() && !found.contains(&taken_for);
        is_another.then(|| Self::OtherModel { taken_for, found: found.to_vec() })
    }

    /// The codes of these warnings, each once, in their order.
    pub fn codes(warnings: &[Self]) -> Vec<&'static str> {
        let mut codes = Vec::new();
        for code in warnings.iter().map(Self::code) {
            if !codes.contains(&code) {
                codes.push(code);
            }
        }
        codes
    }
}

impl Serialize for Warning {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
