//! A coil, its wire or its plug that is broken.

use super::{NOZZLE, SECTION, valves};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::sprayer::SprayerFault;

/// No current.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "coil_open",
    family: Family::Sprayer,
    parameters: &[SECTION, NOZZLE],
    about: "Coils get no current: their valves shut, after their dead times, and stay so.",
    reports: "feedback that does not follow",
    recovery: "tells the driver",
    make: |settings| Ok(PartFault::Sprayer(SprayerFault::CoilOpen(valves(settings)?))),
};
