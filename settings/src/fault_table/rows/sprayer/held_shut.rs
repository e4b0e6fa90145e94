//! The driver's override: all is to be shut.

use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

/// From its beginning to its end.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "held_shut",
    family: Family::Sprayer,
    parameters: &[],
    about: "The driver's override asks for all valves shut. `SprayerState` of the boom's `[sensors]` tells it; the switch moves no valve: to shut them is the controller's work, and what flows meanwhile is forbidden.",
    reports: "the switch's state",
    recovery: "shuts all; as before, after it",
    make: |_| Ok(PartFault::Sprayer(SprayerFault::HeldShut)),
};
