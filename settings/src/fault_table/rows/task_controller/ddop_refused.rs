//! A task controller that does not take the object pool.

use crate::fault_table::parameter::{Form, Parameter};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};
use crate::fault_table::task_controller::TaskControllerFault;

const CODE: Parameter = Parameter::new(
    "code",
    Form::Whole(1, 255),
    "1",
    "bits of the answer to the activation; 1: errors in the pool, 2: no memory",
);

/// From its beginning to its end.
pub(in crate::fault_table::rows) const ROW: Row = Row {
    name: "ddop_refused",
    family: Family::Sprayer,
    parameters: &[CODE],
    about: "Activations of an object pool are refused. A pool that is in use already stays so.",
    reports: "the answer to the activation",
    recovery: "stays safe without a task; tries again",
    make: |settings| {
        let code = settings.whole("code")?.and_then(|code| u8::try_from(code).ok()).unwrap_or(1);
        Ok(PartFault::TaskController(TaskControllerFault::PoolRefused(code)))
    },
};
