//! What a device refuses.

use crate::fault_table::device::{Answer, DeviceFault, Refusal};
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::settings::Settings;

fn refusal(command: Option<String>, answer: Answer, busy: bool) -> PartFault {
    PartFault::Device(DeviceFault::Refusal(Refusal { command, answer, busy }))
}

fn code(settings: &Settings<'_>, default: u16) -> Result<u16, crate::TomlError> {
    Ok(settings.whole("code")?.and_then(|code| u16::try_from(code).ok()).unwrap_or(default))
}

const COMMAND: Parameter = Parameter::new(
    "command",
    Form::Text("the beginning of a command, such as `sWN LMDscandatacfg` or `mEEwriteall`"),
    "every command",
    "only commands of this kind or name",
);

/// No login.
pub(super) const LOGIN: Row = Row {
    name: "login",
    family: Family::Device,
    parameters: &[],
    about: "No password is right: SetAccessMode is answered with 0, a POST of REST with status 10.",
    reports: "refusal in words",
    recovery: "retries where it helps only",
    make: |_| Ok(refusal(Some("SetAccessMode".to_owned()), Answer::Declined, false)),
};

/// Busy.
pub(super) const BUSY: Row = Row {
    name: "busy",
    family: Family::Device,
    parameters: &[COMMAND],
    about: "The device is at work on something else: writes and methods are answered with sFA D, SCdevicestate says busy.",
    reports: "refusal in words",
    recovery: "retries until it is over",
    make: |settings| {
        let command = settings.text("command")?.map(str::to_owned);
        Ok(refusal(command, Answer::Code(0xD), true))
    },
};

/// No room for settings.
pub(super) const EEPROM_FULL: Row = Row {
    name: "eeprom_full",
    family: Family::Device,
    parameters: &[],
    about: "Settings cannot be saved: mEEwriteall is answered with 0, and nothing is kept.",
    reports: "refusal in words",
    recovery: "retries where it helps only",
    make: |_| Ok(refusal(Some("mEEwriteall".to_owned()), Answer::Declined, false)),
};

/// Any code.
pub(super) const FAULT_CODE: Row = Row {
    name: "fault_code",
    family: Family::Device,
    parameters: &[
        COMMAND,
        Parameter::new("code", Form::Whole(1, 65_535), "6, unknown error", "the code of sFA"),
    ],
    about: "Commands are refused with sFA and this code.",
    reports: "refusal in words",
    recovery: "retries where it helps only",
    make: |settings| {
        let command = settings.text("command")?.map(str::to_owned);
        Ok(refusal(command, Answer::Code(code(settings, 6)?), false))
    },
};
