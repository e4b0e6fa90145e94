//! Switches of the driver, and the tank.

use crate::span::Spans;

/// What the driver and the tank say: when each forbids spraying.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Switches {
    /// The master switch is off.
    pub master_off: Spans,
    /// The driver's override asks for all valves shut.
    pub held_shut: Spans,
    /// The tank is empty.
    pub tank_empty: Spans,
}
