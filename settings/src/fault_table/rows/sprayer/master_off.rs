//! The master switch, off.

use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

/// From its beginning to its end.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "master_off",
    family: Family::Sprayer,
    parameters: &[],
    about: "The master switch is off. `SprayerState` of the boom's `[sensors]` tells it; the switch moves no valve: to shut them is the controller's work, and what flows meanwhile is forbidden.",
    reports: "the switch's state",
    recovery: "shuts all; as before, after it",
    make: |_| Ok(PartFault::Sprayer(SprayerFault::MasterOff)),
};
