//! Nobody answers.

use crate::fault::{Action, Door, Fault, Layer, Make};

pub(super) const FAULT: Fault = Fault {
    name: "accept_silent",
    layer: Layer::Accept,
    parameters: &[],
    directions: &[],
    on_wires: false,
    about: "Connections are taken and nothing ever answers, also later.",
    reports: "waiting, attempt number",
    recovery: "redial with backoff, configure anew, stream",
    make: Make::Bytes(|_| Ok(Action::Door(Door::Silent))),
};
