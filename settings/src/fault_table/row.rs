//! One fault: what can be asked for, and what it makes.

use crate::TomlError;

use crate::fault_table::parameter::Parameter;
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::settings::Settings;

/// What a fault is one of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// A scanner's supply, parts and settings.
    Device,
    /// A clock: what stamps say, never time itself.
    Clock,
    /// The tractor and what is on it.
    Vehicle,
    /// The CAN bus.
    Bus,
    /// Datagrams of sentences and of CAN frames.
    Datagrams,
    /// The sprayer and its driver's switches.
    Sprayer,
}

impl Family {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Device => "device",
            Self::Clock => "clock",
            Self::Vehicle => "vehicle",
            Self::Bus => "bus",
            Self::Datagrams => "datagrams",
            Self::Sprayer => "sprayer",
        }
    }
}

/// One fault: what can be asked for, and what it makes.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Its name in files.
    pub name: &'static str,
    /// What it is one of.
    pub family: Family,
    /// Its own parameters, beside the common ones.
    pub parameters: &'static [Parameter],
    /// What it does.
    pub about: &'static str,
    /// What a driver must report.
    pub reports: &'static str,
    /// What recovery is expected.
    pub recovery: &'static str,
    /// Reads its parameters.
    pub make: fn(&Settings<'_>) -> Result<PartFault, TomlError>,
}
