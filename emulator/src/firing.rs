//! What the timeline and its sources tell each other.

use rowscan_ports::Delivery;
use rowscan_protocol::time::SimTime;

/// Why time may go on, where it waits for its takers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Claim {
    /// The source needs no time.
    Idle,
    /// Somebody takes what the source sends.
    Taker,
    /// The source is at work on something a peer waits for: it starts up, or answers.
    Busy,
}

/// How a source acts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Firing {
    pub(crate) at: SimTime,
    /// What is sent may be heard; else time has not started for the takers.
    pub(crate) heard: bool,
    /// The drive has started before.
    pub(crate) driving: bool,
    pub(crate) delivery: Delivery,
}
