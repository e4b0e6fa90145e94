//! A tank in which nothing is left.

use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

/// From its beginning to its end.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "tank_empty",
    family: Family::Sprayer,
    parameters: &[],
    about: "Nothing is left in the tank: it forbids spraying, and with `[hydraulics]` the pump gives nothing.",
    reports: "the tank's empty switch; its level stays",
    recovery: "shuts all; as before, after it",
    make: |_| Ok(PartFault::Sprayer(SprayerFault::TankEmpty)),
};
