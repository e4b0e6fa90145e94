//! Dirt on the front screen.

use std::time::Duration;

use crate::fault_table::device::{DeviceFault, Dirt};
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};

const PARAMETERS: &[Parameter] = &[
    Parameter::new("level", Form::Whole(1, 3), "2", "1 a warning, 2 an error, 3 a serious error"),
    Parameter::new(
        "sector",
        Form::Pair(-90.0, 360.0),
        "no beam is lost",
        "device angles, degrees: from level 2 on, beams between them see nothing",
    ),
    Parameter::new(
        "ramp_s",
        Form::Number(0.0, 3.2e9),
        "0",
        "the level is reached step by step over so many seconds",
    ),
];

const fn row(name: &'static str, about: &'static str) -> Row {
    Row {
        name,
        family: Family::Device,
        parameters: PARAMETERS,
        about,
        reports: "a warning, then an error; beams marked missing",
        recovery: "clears when wiped",
        make: |settings| {
            let level = settings.whole("level")?.and_then(|level| u8::try_from(level).ok()).unwrap_or(2);
            let sector_deg = settings.pair("sector")?;
            if let Some((from, to)) = sector_deg.filter(|(from, to)| from >= to) {
                return Err(settings.refuse(format!(
                    "`sector`: expected where it begins and where it ends, [from, to] with from below to, found [{from}, {to}]: no beam lies between them"
                )));
            }
            let ramp = Duration::from_secs_f64(settings.number("ramp_s")?.unwrap_or(0.0));
            Ok(PartFault::Device(DeviceFault::Dirt(Dirt { level, sector_deg, ramp })))
        },
    }
}

/// By the CoLa scanners' name.
pub(super) const CONTAMINATION: Row = row(
    "contamination",
    "Dirt on the front screen: LCMstate, the device status of scans, or an LMS2xx's status byte and errors tell it.",
);
/// By the LMS2xx's name.
pub(super) const POLLUTION: Row = row("pollution", "The same as `contamination`, by the LMS2xx's name.");
