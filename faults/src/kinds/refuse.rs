//! Nobody listens.

use crate::fault::{Action, Door, Fault, Layer, Make};

pub(super) const FAULT: Fault = Fault {
    name: "refuse",
    layer: Layer::Accept,
    parameters: &[],
    directions: &[],
    on_wires: false,
    about: "Nobody listens: connections are refused. With `count`, so many are taken and reset at once instead, since a closed port cannot count.",
    reports: "waiting, attempt number",
    recovery: "redial with backoff, configure anew, stream",
    make: Make::Bytes(|_| Ok(Action::Door(Door::Refuse))),
};
