//! A client whose status stops.

use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::task_controller::TaskControllerFault;

/// From its beginning to its end.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "heartbeat_stop",
    family: Family::Sprayer,
    parameters: &[],
    about: "The client's status, each 2 s, stops. All else goes on: it hears, answers and obeys.",
    reports: "nothing from the client for 6 s",
    recovery: "the task controller shuts the sections and forgets the client",
    make: |_| Ok(PartFault::TaskController(TaskControllerFault::Silent)),
};
