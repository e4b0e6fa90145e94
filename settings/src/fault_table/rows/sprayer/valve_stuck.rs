//! A valve that stays where it is.

use super::{NOZZLE, SECTION, valves};
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::{SprayerFault, StuckAt};

const STATE: Parameter =
    Parameter::new("state", Form::Word(&["as_it_is", "open", "shut"]), "as_it_is", "where it is stuck");

/// It does not move.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "valve_stuck",
    family: Family::Sprayer,
    parameters: &[SECTION, NOZZLE, STATE],
    about: "Valves stay where they were commanded to, or where `state` says, whatever they are told; at the end they obey what was said last.",
    reports: "feedback that does not follow",
    recovery: "tells the driver, shuts the rest",
    make: |settings| {
        let at = match settings.word("state")? {
            Some("open") => StuckAt::Open,
            Some("shut") => StuckAt::Shut,
            _ => StuckAt::AsItIs,
        };
        Ok(PartFault::Sprayer(SprayerFault::ValveStuck(valves(settings)?, at)))
    },
};
