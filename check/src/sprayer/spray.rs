//! The boom's spray, for scanners to see: what its valves let through while the run goes on.

use std::time::Duration;

use rowscan_bus::CanFrame;
use rowscan_bus::control_function::ControlFunction;
use rowscan_protocol::time::SimTime;
use rowscan_sprayer::live::Reader;

use super::machine::Machine;

/// Scanners see the mean of so long, when it is over.
const PERIOD: Duration = Duration::from_millis(10);

/// Tells scanners what leaves the nozzles. It sends nothing.
#[derive(Debug)]
pub(crate) struct BoomSpray {
    machine: Machine,
    reader: Reader,
    next: Option<SimTime>,
}

impl BoomSpray {
    pub(crate) fn new(machine: Machine) -> Self {
        Self { reader: machine.reader(), machine, next: None }
    }
}

impl ControlFunction for BoomSpray {
    fn open(&mut self, at: SimTime, _out: &mut Vec<CanFrame>) {
        self.next.get_or_insert(at + PERIOD);
    }

    fn next(&self) -> Option<SimTime> {
        self.next
    }

    fn poll(&mut self, at: SimTime, _out: &mut Vec<CanFrame>) {
        if self.next.is_none_or(|next| at < next) {
            return;
        }
        let states = self.machine.look(self.reader, at);
        for (number, share) in (0..=u8::MAX).zip(states.nozzles) {
            self.machine.tractor().set_nozzle_flow(at, number, share);
        }
        self.next = Some(at + PERIOD);
    }

    fn handle(&mut self, _at: SimTime, _frame: &CanFrame, _out: &mut Vec<CanFrame>) {}
}
