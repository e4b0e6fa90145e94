//! The master switch, off.

use crate::part_fault::PartFault;
use crate::row::{Family, Row};
use crate::sprayer::SprayerFault;

/// From its beginning to its end.
pub(in crate::rows) const ROW: Row = Row {
    name: "master_off",
    family: Family::Sprayer,
    parameters: &[],
    about: "The master switch is off. `SprayerState` of the boom's `[sensors]` tells it; the switch moves no valve: to shut them is the controller's work, and what flows meanwhile is forbidden.",
    reports: "the switch's state",
    recovery: "shuts all; as before, after it",
    make: |_| Ok(PartFault::Sprayer(SprayerFault::MasterOff)),
};
