//! What a boom hears on its bus.

use rowscan_bus::CanFrame;
use rowscan_bus::control_function::ControlFunction;
use rowscan_bus::transport::Assembly;
use rowscan_protocol::time::SimTime;
use rowscan_sprayer::Command;

use super::machine::Machine;
use super::spec::SprayerSpec;

/// Tells a machine what is commanded on its bus. It sends nothing.
#[derive(Debug)]
pub(crate) struct BoomHearing {
    machine: Machine,
    spec: SprayerSpec,
    assembly: Assembly,
}

impl BoomHearing {
    pub(crate) fn new(machine: Machine, spec: &SprayerSpec) -> Self {
        Self { machine, spec: spec.clone(), assembly: Assembly::default() }
    }
}

impl ControlFunction for BoomHearing {
    fn open(&mut self, _at: SimTime, _out: &mut Vec<CanFrame>) {}

    fn next(&self) -> Option<SimTime> {
        None
    }

    fn poll(&mut self, _at: SimTime, _out: &mut Vec<CanFrame>) {}

    fn handle(&mut self, at: SimTime, frame: &CanFrame, _out: &mut Vec<CanFrame>) {
        let Some((id, bytes)) = self.assembly.take(frame) else { return };
        for (target, duty) in self.spec.commands(id, &bytes) {
            self.machine.tell(&Command { at, target, duty });
        }
    }
}
