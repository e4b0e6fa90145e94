//! A nozzle that is blocked.

use super::{NOZZLE, SECTION, valves};
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

const SHARE: Parameter =
    Parameter::new("share", Form::Number(0.01, 1.0), "1", "share of the flow that does not come");

/// It gives less.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "blocked_nozzle",
    family: Family::Sprayer,
    parameters: &[SECTION, NOZZLE, SHARE],
    about: "Nozzles give less by this share. One that gives less than a twentieth of its flow counts as shut.",
    reports: "flow below what is expected, in the flow meter and in `SectionStates`, which tell flow and no position",
    recovery: "tells the driver",
    make: |settings| {
        let share = settings.number("share")?.unwrap_or(1.0);
        Ok(PartFault::Sprayer(SprayerFault::BlockedNozzle(valves(settings)?, share)))
    },
};
