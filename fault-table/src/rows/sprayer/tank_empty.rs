//! A tank in which nothing is left.

use crate::part_fault::PartFault;
use crate::row::{Family, Row};
use crate::sprayer::SprayerFault;

/// From its beginning to its end.
pub(in crate::rows) const ROW: Row = Row {
    name: "tank_empty",
    family: Family::Sprayer,
    parameters: &[],
    about: "Nothing is left in the tank: it forbids spraying, and with `[hydraulics]` the pump gives nothing.",
    reports: "the tank's level",
    recovery: "shuts all; as before, after it",
    make: |_| Ok(PartFault::Sprayer(SprayerFault::TankEmpty)),
};
