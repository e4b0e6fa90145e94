//! A valve that is slower than its data sheet.

use super::{NOZZLE, SECTION, valves};
use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

const MS: Parameter = Parameter::new("ms", Form::Strength(0.0, 10_000.0), "100", "later, ms");

/// It comes late.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "valve_slow",
    family: Family::Sprayer,
    parameters: &[SECTION, NOZZLE, MS],
    about: "Valves do what they are told so much later, beside their dead times.",
    reports: "feedback that comes late",
    recovery: "edges within what the time costs",
    make: |settings| {
        let late_s = settings.number("ms")?.unwrap_or(100.0) / 1e3;
        Ok(PartFault::Sprayer(SprayerFault::ValveSlow(valves(settings)?, late_s)))
    },
};
