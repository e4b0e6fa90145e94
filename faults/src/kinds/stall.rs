//! Nothing passes.

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make};

pub(super) const FAULT: Fault = Fault {
    name: "stall",
    layer: Layer::Bytes,
    parameters: &[],
    directions: &Direction::BOTH,
    on_wires: true,
    about: "Nothing passes; what was sent waits, as on a cable that is out for less than TCP's patience.",
    reports: "`stalled` after its own timeout",
    recovery: "resumes, or reconnects; loss = counter gap, exact",
    make: Make::Bytes(|_| Ok(Action::Hold)),
};
