//! LMS2xx models as data: one file a model, one line in [`MODELS`].

mod family;
mod lms200;
mod lms211;
mod lms221;
mod lms291;
mod lms291_s14;
mod optics;

use core::time::Duration;

use super::Variant;
use super::configuration::Configuration;
use super::firmware::Firmware;
use crate::optics::Optics;

/// All models of the family.
pub static MODELS: &[&Model] =
    &[&lms200::LMS200, &lms211::LMS211, &lms221::LMS221, &lms291::LMS291, &lms291_s14::LMS291_S14];

/// Everything that makes one LMS2xx differ from another. Data only; the device reads it.
#[derive(Debug)]
pub struct Model {
    /// Name on the command line and in rig files.
    pub name: &'static str,
    /// Name in print.
    pub title: &'static str,
    /// Its type text, sent at power-up and on request: name, variant, software.
    pub type_text: &'static str,
    /// Its firmware; the type text names it too.
    pub firmware: Firmware,
    /// Whether it is one for outdoors.
    pub outdoor: bool,
    /// Legal variants.
    pub variants: &'static [Variant],
    /// Variant out of the box.
    pub default_variant: Variant,
    /// Angle between the beams of one mirror turn, 1/100°: finer scans take several turns.
    pub turn_step_centideg: u16,
    /// Whether `3B` can choose the variant; a Fast device has its own.
    pub takes_variants: bool,
    /// Whether it has range with reflectivity, mode 50.
    pub reflectivity: bool,
    /// Most bytes that leave it in one mirror turn.
    pub bytes_a_turn: usize,
    /// Configuration block out of the box.
    pub configuration: Configuration,
    /// Nearest range, metres.
    pub min_range_m: f64,
    /// Farthest range, metres.
    pub max_range_m: f64,
    /// What light does in it.
    pub optics: Optics,
    /// How long things take (`field` profile).
    pub times: Times,
    /// What the emulation does as the device does.
    pub emulates: &'static [&'static str],
    /// What it does not, and what it answers then.
    pub not_emulated: &'static [&'static str],
    /// Where the numbers come from, and which are not verified.
    pub evidence: &'static [&'static str],
}

/// How long things take on a real device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// From power-up until the power-on text.
    pub boot: Duration,
    /// From a write of the configuration block to its reply: the EEPROM.
    pub save: Duration,
    /// The same where the unit is another: the device measures its tables again, and hears nothing meanwhile.
    pub new_unit: Duration,
}

/// The mirror turns 75 times a second in every model.
pub const TURNS_PER_SECOND: u32 = 75;

/// The model that a type text names, as it is or with a dash in place of its first semicolon; its software may be another, and its key
/// shorter. Of a key that is not known here, the first model of its name: an `LMS200;S18063` is an LMS200.
pub fn by_type_text(text: &str) -> Option<&'static Model> {
    let ident = text.rsplit_once(';').map_or(text, |(ident, _)| ident);
    let ident = ident.replacen('-', ";", 1);
    let name = ident.split_inclusive(';').next().filter(|name| name.len() > 1)?;
    let begins_so = |start: &str| MODELS.iter().copied().find(|model| model.type_text.starts_with(start));
    begins_so(&ident).or_else(|| begins_so(name))
}

/// Scans a second that the mirror makes of this variant, whatever the line carries; of the first model that has it.
pub fn scans_per_second(variant: Variant) -> f64 {
    let model = MODELS.iter().find(|model| model.variants.contains(&variant));
    let turns = model.map_or_else(|| default_turns(variant), |model| model.turns(variant));
    f64::from(TURNS_PER_SECOND) / f64::from(turns)
}

/// Mirror turns that make one scan of this variant where the model is not known.
pub(crate) fn default_turns(variant: Variant) -> u32 {
    family::OUTDOOR.turns(variant)
}

/// The longest silence inside a telegram.
pub const LONGEST_PAUSE: Duration = Duration::from_millis(6);
/// The least time from one byte of a host to the next at 500 000 bits a second.
pub const LEAST_SPACING: Duration = Duration::from_micros(55);

impl Model {
    /// Mirror turns that make one scan of this variant.
    pub fn turns(&self, variant: Variant) -> u32 {
        u32::from((self.turn_step_centideg / variant.step_centideg.max(1)).max(1))
    }
}
