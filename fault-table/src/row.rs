//! The table of faults of parts: one line a fault.

use std::time::Duration;

use rowscan_strict_toml::TomlError;

use crate::bus::BusFault;
use crate::clock::ClockFault;
use crate::device::DeviceFault;
use crate::parameter::Parameter;
use crate::settings::Settings;
use crate::vehicle::{DriveFault, EncoderFault, GnssFault};
use crate::{bus, clock, device, vehicle};

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
}

impl Family {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Device => "device",
            Self::Clock => "clock",
            Self::Vehicle => "vehicle",
            Self::Bus => "bus",
        }
    }
}

/// A fault as its part gets it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PartFault {
    /// Of a scanner.
    Device(DeviceFault),
    /// Of a scanner's clock.
    Clock(ClockFault),
    /// Of the wheel encoder.
    Encoder(EncoderFault),
    /// Of the GNSS receiver.
    Gnss(GnssFault),
    /// Of the drive.
    Drive(DriveFault),
    /// Of a bus.
    Bus(BusFault),
}

impl PartFault {
    /// How long it lasts by itself, where neither `for` nor `until` says.
    pub fn lasts(&self) -> Option<Duration> {
        match self {
            Self::Device(DeviceFault::Power(power)) => power.lasts(),
            Self::Bus(BusFault::Off { restart: Some(restart) }) => Some(*restart),
            _ => None,
        }
    }

    /// True if nothing passes to or from the device meanwhile, and its connections never come back.
    pub fn cuts_connections(&self) -> bool {
        matches!(self, Self::Device(DeviceFault::Power(_)))
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

/// Every fault of a part.
pub const ROWS: &[Row] = &[
    device::power::ROW,
    device::dirt::CONTAMINATION,
    device::dirt::POLLUTION,
    device::broken::MOTOR,
    device::broken::LASER,
    device::broken::TEMPERATURE,
    device::refusal::LOGIN,
    device::refusal::BUSY,
    device::refusal::EEPROM_FULL,
    device::refusal::FAULT_CODE,
    device::stored::ROW,
    clock::DRIFT,
    clock::STEP,
    clock::WRAP,
    clock::NTP_JUMP,
    vehicle::encoder::ROW,
    vehicle::gnss::ROW,
    vehicle::drive::SPEED_COMMAND,
    vehicle::drive::STOP,
    vehicle::drive::REVERSE,
    vehicle::drive::LATERAL,
    vehicle::drive::BOUNCE,
    bus::controller::OFF,
    bus::controller::PASSIVE,
    bus::controller::LOAD,
    bus::controller::ERROR,
    bus::controller::ACK_NONE,
    bus::node::ADDRESS_STEAL,
    bus::node::NO_TECU,
    bus::node::TWO_TECU,
    bus::node::NAME_CLASH,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_their_keys_are_unique() {
        let unique = |mut names: Vec<&str>| {
            let all = names.len();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), all, "{names:?}");
        };
        unique(ROWS.iter().map(|row| row.name).collect());
        for row in ROWS {
            unique(row.parameters.iter().map(|parameter| parameter.key).collect());
        }
    }
}
