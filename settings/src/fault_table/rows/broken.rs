//! A part of the scanner that fails.

use crate::fault_table::device::{Broken, DeviceFault, Piece};
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};

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
pub(super) const MOTOR: Row = row!(
    "motor",
    Piece::Motor,
    "The mirror stands: no scans; SCdevicestate tells an error, STlms an undefined state.",
    PARAMETERS
);
/// The laser.
pub(super) const LASER: Row = row!(
    "laser",
    Piece::Laser,
    "The laser is off: scans go on, no beam sees anything, and their device status tells an error.",
    PARAMETERS
);
/// The temperature.
pub(super) const TEMPERATURE: Row = row!(
    "temperature",
    Piece::Temperature,
    "Too hot or too cold: STlms tells it, and the device status of scans an error; scans go on.",
    PARAMETERS
);
