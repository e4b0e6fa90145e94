//! A part of the scanner that fails.

use crate::device::DeviceFault;
use crate::{Family, Form, Parameter, PartFault, Row};

/// A part that fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Broken {
    /// Which.
    pub part: Piece,
    /// The device stays out of order after the end, until it is restarted.
    pub until_reboot: bool,
}

/// A part of a scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece {
    /// The mirror's motor.
    Motor,
    /// The laser.
    Laser,
    /// What cools or heats it.
    Temperature,
}

const PARAMETERS: &[Parameter] = &[Parameter::new(
    "until_reboot",
    Form::Flag,
    "false",
    "the device stays out of order after the end, until it is restarted",
)];

macro_rules! row {
    ($name:literal, $piece:expr, $about:literal, $parameters:expr) => {
        Row {
            name: $name,
            family: Family::Device,
            parameters: $parameters,
            about: $about,
            reports: "device error and its code",
            recovery: "by itself, or after a restart, as `until_reboot` says; which models need one is not recorded",
            make: |settings| {
                let until_reboot = settings.flag("until_reboot")?;
                Ok(PartFault::Device(DeviceFault::Broken(Broken { part: $piece, until_reboot })))
            },
        }
    };
}

/// The motor.
pub const MOTOR: Row = row!(
    "motor",
    Piece::Motor,
    "The mirror stands: no scans; SCdevicestate tells an error, STlms an undefined state.",
    PARAMETERS
);
/// The laser.
pub const LASER: Row = row!(
    "laser",
    Piece::Laser,
    "The laser is off: scans go on, no beam sees anything, and their device status tells an error.",
    PARAMETERS
);
/// The temperature.
pub const TEMPERATURE: Row = row!(
    "temperature",
    Piece::Temperature,
    "Too hot or too cold: STlms tells it, and the device status of scans an error; scans go on.",
    PARAMETERS
);
