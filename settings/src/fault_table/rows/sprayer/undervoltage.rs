//! A supply that is too weak to hold valves.

use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

/// None is held open.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "undervoltage",
    family: Family::Sprayer,
    parameters: &[],
    about: "The voltage is too low to hold any valve open: all shut, and open again at the end where they are told to. The pump goes on, and so does the controller.",
    reports: "feedback that does not follow",
    recovery: "valves as told, after it",
    make: |_| Ok(PartFault::Sprayer(SprayerFault::Undervoltage)),
};
