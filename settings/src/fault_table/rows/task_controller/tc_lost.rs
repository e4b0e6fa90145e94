//! A task controller that is gone.

use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::task_controller::TaskControllerFault;

/// From its beginning to its end.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "tc_lost",
    family: Family::Sprayer,
    parameters: &[],
    about: "Task controller and client do not hear each other: neither its status nor anything else.",
    reports: "6 s without a status; the client then does what `on_loss` says",
    recovery: "6 s of silence later, and after it, connects anew with its pool",
    make: |_| Ok(PartFault::TaskController(TaskControllerFault::Lost)),
};
