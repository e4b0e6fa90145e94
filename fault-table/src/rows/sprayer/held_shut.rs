//! The driver's override: all shut.

use crate::part_fault::PartFault;
use crate::row::{Family, Row};
use crate::sprayer::SprayerFault;

/// From its beginning to its end.
pub(in crate::rows) const ROW: Row = Row {
    name: "held_shut",
    family: Family::Sprayer,
    parameters: &[],
    about: "The driver holds the valves shut by the override. It forbids spraying and shuts nothing: that is the controller's work.",
    reports: "the switch's state",
    recovery: "shuts all; as before, after it",
    make: |_| Ok(PartFault::Sprayer(SprayerFault::HeldShut)),
};
