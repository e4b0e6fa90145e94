//! A serial wire with faults on it.

use rowscan_faults::{Direction, StreamFaults};
use rowscan_ports::Wire;
use rowscan_recording::{Side, Tap};

/// Puts `faults` on a serial wire; `tap` records what goes over it: after faults what the client gets, before them what it sends.
pub(crate) fn faulty_wire(wire: Box<dyn Wire>, faults: &StreamFaults, tap: Tap) -> Box<dyn Wire> {
    Box::new(faults.wrap(wire, |_| ()).witnessed(move |direction, bytes| {
        tap.record(if direction == Direction::ToClient { Side::Device } else { Side::Host }, bytes);
    }))
}
