//! Faults of the drive: the tractor does not go as it was told to. Scanners, encoder and GNSS go with it.

use std::time::Duration;

use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::settings::Settings;
use crate::fault_table::vehicle::DriveFault;

const CHANGE: Parameter =
    Parameter::new("change_m_s2", Form::Number(0.01, 100.0), "0.5", "how fast the speed changes, m/s²");

fn speed(settings: &Settings<'_>, m_s: f64) -> Result<PartFault, crate::TomlError> {
    let change_m_s2 = settings.number("change_m_s2")?.unwrap_or(0.5);
    Ok(PartFault::Drive(DriveFault::Speed { m_s, change_m_s2 }))
}

/// Another speed.
pub(super) const SPEED_COMMAND: Row = Row {
    name: "speed_command",
    family: Family::Vehicle,
    parameters: &[Parameter::new("m_s", Form::Number(0.0, 15.0), "must be given", "speed, m/s"), CHANGE],
    about: "The tractor makes for this speed; at the end for its own again. Its place follows.",
    reports: "speed",
    recovery: "areas by the advance",
    make: |settings| speed(settings, settings.needed("m_s")?),
};

/// No speed.
pub(super) const STOP: Row = Row {
    name: "stop",
    family: Family::Vehicle,
    parameters: &[CHANGE],
    about: "The tractor stops; at the end it goes on.",
    reports: "speed 0",
    recovery: "areas by the advance",
    make: |settings| speed(settings, 0.0),
};

/// The other way.
pub(super) const REVERSE: Row = Row {
    name: "reverse",
    family: Family::Vehicle,
    parameters: &[Parameter::new("m_s", Form::Number(0.0, 15.0), "1", "speed in reverse, m/s"), CHANGE],
    about: "The tractor stops and goes back the way it came; at the end it goes on forward.",
    reports: "speed, direction",
    recovery: "areas by the advance: nothing is counted twice",
    make: |settings| speed(settings, -settings.number("m_s")?.unwrap_or(1.0)),
};

/// Beside its way.
pub(super) const LATERAL: Row = Row {
    name: "lateral",
    family: Family::Vehicle,
    parameters: &[
        Parameter::new(
            "m",
            Form::Strength(-5.0, 5.0),
            "must be given",
            "to its right, metres; negative: left",
        ),
        Parameter::new("over_s", Form::Number(0.0, 3600.0), "1", "the shift takes so long, s; 0 is a jump"),
    ],
    about: "The tractor drives beside its way, and comes back at the end.",
    reports: "distance to the row",
    recovery: "areas within what the distance costs",
    make: |settings| {
        let over = Duration::from_secs_f64(settings.number("over_s")?.unwrap_or(1.0));
        Ok(PartFault::Drive(DriveFault::Lateral { m: settings.needed("m")?, over }))
    },
};

/// Up and down.
pub(super) const BOUNCE: Row = Row {
    name: "bounce",
    family: Family::Vehicle,
    parameters: &[
        Parameter::new("m", Form::Number(0.0, 1.0), "0.05", "up and down by so much, metres"),
        Parameter::new("hz", Form::Number(0.01, 20.0), "2", "so often a second"),
        Parameter::new(
            "roll_deg",
            Form::Number(-30.0, 30.0),
            "0",
            "rolls by so much, degrees, right side down first",
        ),
    ],
    about: "The tractor goes up and down on its tyres, and rolls.",
    reports: "nothing",
    recovery: "areas within what the height costs",
    make: |settings| {
        Ok(PartFault::Drive(DriveFault::Bounce {
            m: settings.number("m")?.unwrap_or(0.05),
            hz: settings.number("hz")?.unwrap_or(2.0),
            roll_rad: settings.number("roll_deg")?.unwrap_or(0.0).to_radians(),
        }))
    },
};
