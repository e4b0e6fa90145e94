//! One direction closed.

use crate::event::Direction;
use crate::fault::{Action, Cut, Fault, Layer, Make};

pub(super) const FAULT: Fault = Fault {
    name: "half_close",
    layer: Layer::Connection,
    parameters: &[],
    directions: &[Direction::ToClient],
    on_wires: false,
    about: "One direction is closed in order, the other goes on.",
    reports: "disconnected, reason, once",
    recovery: "redial with backoff, configure anew, stream",
    make: Make::Bytes(|_| Ok(Action::Cut(Cut::HalfClose))),
};
