//! A connection closed.

use crate::event::Direction;
use crate::fault::{Action, Cut, Fault, Layer, Make};

pub(super) const FAULT: Fault = Fault {
    name: "fin",
    layer: Layer::Connection,
    parameters: &[],
    directions: &Direction::BOTH,
    on_wires: false,
    about: "The connection is closed in order, after what was sent before.",
    reports: "disconnected, reason, once",
    recovery: "redial with backoff, configure anew, stream",
    make: Make::Bytes(|_| Ok(Action::Cut(Cut::Finish))),
};
