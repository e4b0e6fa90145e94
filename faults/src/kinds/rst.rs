//! A connection reset.

use crate::event::Direction;
use crate::fault::{Action, Cut, Fault, Layer, Make};

pub(super) const FAULT: Fault = Fault {
    name: "rst",
    layer: Layer::Connection,
    parameters: &[],
    directions: &Direction::BOTH,
    on_wires: false,
    about: "The connection is reset, both ways.",
    reports: "disconnected, reason, once",
    recovery: "redial with backoff, configure anew, stream",
    make: Make::Bytes(|_| Ok(Action::Cut(Cut::Reset))),
};
