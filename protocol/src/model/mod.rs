//! Scanner models as data: one file a model, one line in [`MODELS`].

mod any;
mod compact;
mod family;
mod interlace;
mod layer;
mod lms100;
mod lms1000;
mod lms111;
mod lms151;
mod lms500;
mod lms511;
mod lms511_lite;
mod mrs1000;
mod multiscan136;
pub(crate) mod optics;
mod picoscan120;
mod picoscan150;
mod scatter;
mod scatters;
mod tim551;
mod tim561;
mod tim571;
mod tim781;
mod tim781s;

use core::time::Duration;

pub use any::{AnyModel, UnknownModel};
pub use compact::CompactOutput;
pub use layer::Layer;
pub use scatter::Scatter;

use crate::angle::BeamGrid;
use crate::optics::Optics;
use crate::telegram::Variable;
use crate::telegram::scan_layer_filter::ScanLayerFilter;

/// The models whose scans go out as LMDscandata out of the box.
pub static MODELS: &[&Model] = &[
    &lms111::LMS111,
    &lms100::LMS100,
    &lms151::LMS151,
    &lms511::LMS511,
    &lms500::LMS500,
    &lms511_lite::LMS511_LITE,
    &tim551::TIM551,
    &tim561::TIM561,
    &tim571::TIM571,
    &tim781::TIM781,
    &tim781s::TIM781S,
    &mrs1000::MRS1000,
    &lms1000::LMS1000,
];

/// The models that send their scans as Compact telegrams over UDP out of the box, and speak CoLa besides.
pub static SEGMENTED: &[&Model] =
    &[&picoscan150::PICOSCAN150, &picoscan120::PICOSCAN120, &multiscan136::MULTISCAN136];

/// All models that speak CoLa.
pub fn all() -> impl Iterator<Item = &'static Model> + Clone {
    MODELS.iter().chain(SEGMENTED).copied()
}

/// What every model emulates.
pub const ALL_EMULATE: &[&str] = &[
    "both CoLa dialects, decimal and hex arguments, switched by EIHstCola",
    "LMDscandata: echo mask, 8- or 16-bit remission, position block (zeros), device name, comment, time, output rate; LMDscandatamon with it",
    "LFPmeanfilter (one scan for all of a mean), LFPmedianfilter (3 beams), LFPparticle, MSsuppmode (fog filter; through a device's eye), SetActiveApplications",
    "LIDinputstate and LIDoutputstate events when a line changes; LFErec for circles about the scanner (up to four fields; TiM7xx three, always reported; TiM5xx one)",
    "user levels, write protection, sFA codes (docs/refusals.md); settings kept by mEEwriteall, lost by mSCreboot",
];

/// What none emulates, and what is answered then.
pub const NONE_EMULATE: &[&str] = &[
    "evaluation fields other than those circles: fieldNNN reads as one that nobody has set",
    "network and time server variables (EIIpAddr, EImask, EIgate, TSC…) and LMPautostartmeas: read, and sFA 4 for any other value",
    "the angles of mLMPsetscancfg: ignored, as the manual has it for LMS1xx and LMS5xx; code 4 is answered where LMPoutputRange would hold no beam of the new mode",
    "the device's own limit of connections, which is not known: 32 in either profile",
    "user levels 2 and 4 have no rights of their own; the service password is not known",
    "NTP, parameter files, firmware update, SOPAS' own variables: sFA 3, 2 or F by kind",
];

/// What is not certain of any.
pub const ALL_EVIDENCE: &[&str] = &[
    "FREchoFilter and SetActiveApplications replies without a trailing blank: recorded on an MRS1104 only",
    "DeviceIdent: shape as recorded on other models; --ident and --firmware say otherwise; DItype and OrdNum: not verified",
    "operating hours and power-on count of the first LMS1xx, LMS5xx and TiM7xx are the recorded ones; further scanners' and models' differ from them by a rule of ours",
    "TSCTCtimezone, TSCTCmaxoffset, TSCTCdelay: types and the hour + 12 by public clients, values assumed; ODopdaily in tenths of an hour since power-up, LMPautostartmeas (LMS1xx, LMS5xx): assumed",
    "rules of the filters: not verified; MSsuppmode by its name and codes in a public driver, 0 out of the box assumed",
    "LMDscandatacfg out of the box (first echo, no remission, no time, every scan): not known; all recorded reads followed a client's write",
    "FREchoFilter out of the box (all echoes; with --optics device the last one of an LMS5xx, docs/optics.md), encoder and filter settings: assumed; no recording reads one before its client wrote it",
    "LocationName `not defined`: recorded before any write on an LMS111 and a TiM781S, as delivered; an LMS511's `SN 18110550` is as somebody left it",
    "encoder: position in the wheel's ticks, LICencres in ticks/mm, speed in mm/ms: assumed; the listing gives the speed in ticks/mm, which is no speed",
];

/// Models that are left out, and why.
pub const NOT_MODELLED: &[(&str, &str)] =
    &[("multiScan165, LRS4000", "`decode` reads their telegrams; nothing sends them")];

/// Everything that makes one scanner differ from another. Data only; the device reads it.
#[derive(Debug)]
pub struct Model {
    /// Name on the command line and in rig files.
    pub name: &'static str,
    /// Name in print.
    pub title: &'static str,
    /// Name in DeviceIdent: of the device's family and application rather than of the model.
    pub ident_name: &'static str,
    /// Type code, in DItype.
    pub type_code: &'static str,
    /// Order number, in OrdNum.
    pub order_number: &'static str,
    /// Version in DeviceIdent.
    pub ident_version: &'static str,
    /// FirmwareVersion, with the blanks real devices pad it with.
    pub firmware: &'static str,
    /// First beam, 1/10000°.
    pub start_angle: i32,
    /// Last beam, 1/10000°.
    pub stop_angle: i32,
    /// Legal scan modes.
    pub modes: &'static [ScanMode],
    /// Scan mode out of the box.
    pub default_mode: ScanMode,
    /// Nearest range the device reports, metres.
    pub min_range_m: f64,
    /// Farthest range the device reports, metres.
    pub max_range_m: f64,
    /// What the mirror does in every mode, where the finer modes are interlaced of such turns.
    pub turn: Option<ScanMode>,
    /// LMDscandatacfg takes bit 1 of the remission: scans carry a table of angles, [`ANGLES`](crate::telegram::lmd_scandata::ANGLES).
    pub angle_table: bool,
    /// What a beam without an echo reads, raw.
    pub no_echo: u16,
    /// What light does in it.
    pub optics: Optics,
    /// The layers that its turns are of, one after the other and again from the first, as scans name them: 1/100°, negative upwards
    /// ([`elevation_deg`](crate::scan::elevation_deg)). One layer of 0 on a scanner with one plane.
    pub layers: &'static [i16],
    /// Echoes it can tell apart.
    pub echoes: u8,
    /// LMDscandatacfg takes an echo mask of 0; one echo is sent then.
    pub takes_empty_echo_mask: bool,
    /// Encoders it can count.
    pub encoders: u8,
    /// Width of the remission out of the box.
    pub remission: RemissionWidth,
    /// Version of the LMDscandata telegram.
    pub scandata_version: u16,
    /// Device number in it.
    pub device_number: u16,
    /// A poll before the first scan is answered with a scan of zeros, and not refused.
    pub zeros_before_first_scan: bool,
    /// Value of the scan counter in the first scan after LMCstartmeas; none where it keeps counting.
    pub scan_counter_restart: Option<u16>,
    /// Device time from the mirror's zero index to the transmission, µs (`bench` profile).
    pub transmit_delay_us: u32,
    /// How much longer than nominal a real one's period is, parts per million (`field` profile).
    pub period_ppm: i32,
    /// How periods and times of transmission scatter (`field` profile).
    pub scatter: Scatter,
    /// What the first scans after LMCstartmeas are marked with.
    pub start_up: StartUp,
    /// Scans carry the device's name whatever LMDscandatacfg says.
    pub names_itself: bool,
    /// Operating hours of the first scanner of a bench, tenths of an hour.
    pub operating_hours: u32,
    /// How often it was switched on.
    pub power_on_count: u32,
    /// First byte of the digital outputs in a scan, once running.
    pub outputs: u8,
    /// Digital lines.
    pub lines: DigitalLines,
    /// Number of evaluation fields, `field000` on.
    pub fields: u16,
    /// How those read that nobody has set.
    pub slots: Slots,
    /// Evaluation fields with a result in LFErec.
    pub evaluations: Evaluations,
    /// User levels with their passwords.
    pub logins: &'static [Password],
    /// Commands whose binary `sWA` does not end in a blank.
    pub replies_without_blank: &'static [&'static str],
    /// Commands other models have and this one does not.
    pub lacks: &'static [&'static str],
    /// How long things take (`field` profile).
    pub times: Times,
    /// Its Compact telegrams over UDP, and the variables of CoLa and REST that come with them.
    pub compact: Option<&'static CompactOutput>,
    /// What the emulation does as the device does, besides [`ALL_EMULATE`].
    pub emulates: &'static [&'static str],
    /// What it does not, and what it answers then, besides [`NONE_EMULATE`].
    pub not_emulated: &'static [&'static str],
    /// Where the numbers come from, and which are not verified, besides [`ALL_EVIDENCE`].
    pub evidence: &'static [&'static str],
}

/// A legal pair of scan frequency and angular step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ScanMode {
    /// Mirror turns, 1/100 Hz.
    pub frequency_centihz: u32,
    /// Angle between beams, 1/10000°, as the wire rounds it.
    pub step: u16,
}

/// Width of the remission values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RemissionWidth {
    /// RSSI channels of 8 bits.
    Bits8,
    /// RSSI channels of 16 bits.
    Bits16,
}

/// How the first scans after LMCstartmeas differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StartUp {
    /// How many.
    pub scans: u32,
    /// First byte of their device status: 1 while the laser is off.
    pub status: u8,
    /// First byte of their digital outputs.
    pub outputs: u8,
}

/// Digital inputs and outputs, as LIDinputstate and LIDoutputstate report them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DigitalLines {
    /// Version of both telegrams.
    pub version: u16,
    /// Each input: 0 off, 1 on, 2 unused.
    pub inputs: [u8; 4],
    /// LIDinputstate carries the time of day, and a time since power-up that is not 0.
    pub inputs_timed: bool,
    /// Time since power-up at which the inputs are first read, µs.
    pub inputs_read_us: u32,
    /// Each output: 0 off, 1 on, 2 unused.
    pub outputs: &'static [u8],
    /// A subscription to LIDoutputstate is followed by the outputs as they are.
    pub outputs_told_at_once: bool,
}

/// How evaluation fields read that nobody has set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slots {
    /// How many, from `field000` on, read as an empty shape; the others as one byte of zero.
    pub shaped: u16,
    /// Scale of their ranges.
    pub scale: f32,
    /// Angle between their beams, 1/10000°.
    pub step: u32,
    /// They have numbers and names, `Field001` on.
    pub named: bool,
}

/// Evaluation fields that LFErec reports on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Evaluations {
    /// Results that are there whether their fields are set or not.
    pub always: u8,
    /// Fields that can be set.
    pub most: u8,
}

/// How long things take on a real device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// From power-up until telegrams are answered.
    pub boot: Duration,
    /// From then until measuring can begin.
    pub initialisation: Duration,
    /// Until the motor turns as fast as it shall.
    pub spin_up: Duration,
    /// From then, or from LMCstartmeas, until the first scan.
    pub first_scan: Duration,
    /// From LMCstartmeas in a new scan mode until SCdevicestate reports ready.
    pub busy_after_new_mode: Duration,
    /// From a request to its reply.
    pub reply: Duration,
    /// The same for SetAccessMode.
    pub login_reply: Duration,
    /// The same for LMCstartmeas.
    pub start_reply: Duration,
    /// The same for mEEwriteall.
    pub save_reply: Duration,
}

/// A user level and the hash of its password.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Password {
    /// 2 maintenance, 3 authorised client, 4 service.
    pub level: u8,
    /// The hash SetAccessMode carries.
    pub hash: u32,
}

/// Maintenance, password `main` (manual).
const MAINTENANCE: Password = Password { level: 2, hash: 0xB21A_CE26 };
/// Authorised client, password `client` (manual, recordings).
pub(crate) const CLIENT: Password = Password { level: 3, hash: 0xF472_4744 };

/// The model of that name, whatever the case.
pub fn by_name(name: &str) -> Option<&'static Model> {
    all().find(|model| model.name.eq_ignore_ascii_case(name))
}

/// Shorthand for the tables.
const fn mode(frequency_hz: u32, step: u16) -> ScanMode {
    ScanMode { frequency_centihz: frequency_hz * 100, step }
}

/// The models that a DeviceIdent may be of, in the order of [`MODELS`]: several where it names a family, as `LMS10x_FieldEval` does. Those whose
/// name stands at its beginning in most letters (TiM781S before TiM781); the name is the model's title, what its DeviceIdent says, or the family alone.
///
/// ```
/// use rowscan_protocol::model::by_ident;
/// let names = |ident| by_ident(ident).map(|model| model.name).collect::<Vec<_>>();
/// assert_eq!(names("LMS10x_FieldEval V1.36-21.10.2010"), ["lms111", "lms100", "lms151"]);
/// assert_eq!(names("TiM781S V3.13"), ["tim781s"]);
/// assert_eq!(names("MRS1xxxx 1.0.0.0R"), ["mrs1000"]);
/// assert_eq!(names("LMS1000 2.2.1.0R"), ["lms1000"]);
/// ```
pub fn by_ident(ident: &str) -> impl Iterator<Item = &'static Model> + Clone {
    let ident = ident.trim();
    let common = move |model: &Model| {
        let family = model.ident_name.split('_').next().unwrap_or_default();
        let begins = |name: &&str| {
            let (start, rest) = ident.split_at_checked(name.len()).unwrap_or_default();
            // An LMS1000 is no LMS100.
            start.eq_ignore_ascii_case(name) && !rest.starts_with(char::is_alphanumeric)
        };
        [model.title, model.ident_name, family]
            .iter()
            .filter(|name| begins(name))
            .map(|name| name.len())
            .max()
    };
    let most = all().filter_map(common).max();
    all().filter(move |model| most.is_some() && common(model) == most)
}

impl Model {
    /// Whether its scans tell what a wheel encoder counts: in their own telegrams, or beside Compact telegrams in those of the encoder.
    pub fn tells_ticks(&self) -> bool {
        self.encoders > 0 || self.compact.is_some_and(|compact| compact.has("EncoderDataEnable"))
    }

    /// Whether its scans say how it is, such as that its window is dirty: Compact telegrams have no word for it.
    pub fn scans_tell_status(&self) -> bool {
        self.compact.is_none()
    }

    /// The full beam grid in a scan mode; of an interlaced one, the beams of all its turns.
    pub fn beams(&self, mode: ScanMode) -> BeamGrid {
        BeamGrid::spanning(self.start_angle, self.stop_angle, mode.step)
    }

    /// Whether it has the command or variable `name`, if others of its family have it. A filter of layers takes several of them.
    pub fn has(&self, name: &str) -> bool {
        !self.lacks.contains(&name)
            && self.compact.is_none_or(|compact| compact.has(name))
            && (name != ScanLayerFilter::NAME || self.layers.len() > 1)
    }

    /// The layer of the turn with this number since power-up.
    pub fn layer(&self, turn: u64) -> i16 {
        let count = self.layers.len().max(1) as u64;
        self.layers.get((turn % count) as usize).copied().unwrap_or_default()
    }

    /// The number that a scan mode has in PerformanceProfileNumber, from 1 on; `None` where the model has no profiles, or none of this mode.
    pub fn profile(&self, mode: ScanMode) -> Option<u8> {
        let profiles = usize::from(self.compact?.profiles);
        let place = self.modes.iter().take(profiles).position(|known| *known == mode)?;
        u8::try_from(place + 1).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_in_any_case_and_are_unique() {
        for model in all() {
            assert!(core::ptr::eq(by_name(&model.title.to_ascii_uppercase()).unwrap(), model));
            assert_eq!(all().filter(|other| other.name == model.name).count(), 1);
            assert!(model.modes.contains(&model.default_mode));
        }
        assert!(by_name("lms999").is_none());
    }
}
