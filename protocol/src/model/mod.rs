//! Scanner models as data: one file a model, one line in [`MODELS`].

mod lms111;

use crate::angle::BeamGrid;

/// A legal pair of scan frequency and angular step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ScanMode {
    /// Mirror turns, 1/100 Hz.
    pub frequency_centihz: u32,
    /// Angle between beams, 1/10000°, as the wire rounds it.
    pub step: u16,
}

/// Everything that makes one scanner differ from another.
#[derive(Debug)]
pub struct Model {
    /// Name on the command line and in rig files.
    pub name: &'static str,
    /// Name in print.
    pub title: &'static str,
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
    /// Echoes it can tell apart.
    pub echoes: u8,
    /// What the emulation does as the device does.
    pub emulates: &'static [&'static str],
    /// What it does not, and what it answers then.
    pub not_emulated: &'static [&'static str],
    /// Where the numbers come from.
    pub evidence: &'static [&'static str],
}

/// All models.
pub static MODELS: &[&Model] = &[&lms111::LMS111];

/// The model of that name, whatever the case.
pub fn by_name(name: &str) -> Option<&'static Model> {
    MODELS.iter().copied().find(|model| model.name.eq_ignore_ascii_case(name))
}

impl Model {
    /// The full beam grid in a scan mode.
    pub fn beams(&self, mode: ScanMode) -> BeamGrid {
        BeamGrid::spanning(self.start_angle, self.stop_angle, mode.step)
    }
}
