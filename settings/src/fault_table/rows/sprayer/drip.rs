//! A valve that does not shut tightly.

use super::{NOZZLE, SECTION, valves};
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

const SHARE: Parameter =
    Parameter::new("share", Form::Number(0.0001, 0.05), "0.02", "share of full flow, a twentieth at most");

/// It drips.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "drip",
    family: Family::Sprayer,
    parameters: &[SECTION, NOZZLE, SHARE],
    about: "Nozzles drip while they are shut. That is no open nozzle: it counts in litres alone.",
    reports: "flow while all is shut, in the flow meter and in `SectionStates`, which tell flow",
    recovery: "tells the driver",
    make: |settings| {
        let share = settings.number("share")?.unwrap_or(0.02);
        Ok(PartFault::Sprayer(SprayerFault::Drip(valves(settings)?, share)))
    },
};
