//! Nobody answers.

use crate::fault::{Action, Door, Fault, Layer};

pub(super) const FAULT: Fault = Fault {
    name: "accept_silent",
    layer: Layer::Accept,
    parameters: &[],
    directions: &[],
    on_wires: false,
    about: "Connections are taken and nothing ever answers, also later.",
    reports: "waiting, attempt number",
    recovery: "redial with backoff, configure anew, stream",
    make: |_| Ok(Action::Door(Door::Silent)),
};
