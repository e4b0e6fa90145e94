//! A peer that is gone.

use crate::event::Direction;
use crate::fault::{Action, Cut, Fault, Layer, Make};

pub(super) const FAULT: Fault = Fault {
    name: "half_open",
    layer: Layer::Connection,
    parameters: &[],
    directions: &Direction::BOTH,
    on_wires: true,
    about: "The other side is gone and does not say so: bytes vanish. Connections that stand or are made meanwhile never come back; after the end, new ones work, and an old one that speaks is reset. On a serial wire bytes vanish until the end.",
    reports: "`stalled` after its own timeout",
    recovery: "redial with backoff, configure anew, stream",
    make: Make::Bytes(|_| Ok(Action::Cut(Cut::HalfOpen))),
};
