//! The door is shut again.

use crate::fault::{Action, Door, Fault, Layer, Make};

pub(super) const FAULT: Fault = Fault {
    name: "accept_close",
    layer: Layer::Accept,
    parameters: &[],
    directions: &[],
    on_wires: false,
    about: "Connections are taken and closed at once.",
    reports: "waiting, attempt number",
    recovery: "redial with backoff, configure anew, stream",
    make: Make::Bytes(|_| Ok(Action::Door(Door::Close))),
};
