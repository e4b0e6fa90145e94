//! A task controller that has no time.

use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::task_controller::TaskControllerFault;

/// From its beginning to its end.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "tc_busy",
    family: Family::Sprayer,
    parameters: &[],
    about: "The task controller's status says that it is busy; it answers no question and commands nothing.",
    reports: "the busy bits of its status",
    recovery: "sections stay as they are meanwhile; after it, follows the next command",
    make: |_| Ok(PartFault::TaskController(TaskControllerFault::Busy)),
};
