//! What a boom hears: commands on its bus, and what its sections were told as a task controller's client.

use rowscan_bus::CanFrame;
use rowscan_bus::isobus::role::SectionLog;
use rowscan_bus::transport::Assembly;
use rowscan_protocol::time::SimTime;
use rowscan_sprayer::Command;

use super::client;
use super::spec::SprayerSpec;

/// Hears the commands of a boom.
#[derive(Debug)]
pub(super) struct Hearing {
    spec: SprayerSpec,
    assembly: Assembly,
    /// What sections of a task controller's client were told, and how much of that was heard.
    orders: (SectionLog, usize),
}

impl Hearing {
    /// Those of this sprayer.
    pub(super) fn new(spec: &SprayerSpec, orders: SectionLog) -> Self {
        Self { spec: spec.clone(), assembly: Assembly::default(), orders: (orders, 0) }
    }

    /// Orders of a client's sections since the last call.
    pub(super) fn ordered(&mut self) -> Vec<Command> {
        let (log, heard) = &mut self.orders;
        let new: Vec<Command> = client::commands(log, *heard).collect();
        *heard += new.len();
        new
    }

    /// What a frame of its bus commands.
    pub(super) fn heard(&mut self, at: SimTime, frame: &CanFrame) -> Vec<Command> {
        let Some((id, bytes)) = self.assembly.take(frame) else { return Vec::new() };
        let commands = self.spec.commands(id, &bytes).into_iter();
        commands.map(|(target, duty)| Command { at, target, duty }).collect()
    }
}
