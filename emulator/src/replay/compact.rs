//! A recorded picoScan: how it was set, by its Compact telegrams.

use std::time::Duration;

use rowscan_protocol::compact::CompactListener;
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model::{Model, ScanMode};
use rowscan_protocol::scan::Scan;

/// What the recorded datagrams of a stream tell of their device.
#[derive(Debug, Default)]
pub struct CompactPart {
    listener: CompactListener,
    /// The first turn.
    pub(super) first: Option<Scan>,
}

impl CompactPart {
    /// Takes the next telegram; how many turns are whole with it.
    pub(super) fn take(&mut self, telegram: &[u8]) -> u64 {
        self.listener.handle_datagram(Duration::ZERO, telegram);
        self.turns()
    }

    /// No more telegrams come; how many turns are whole now.
    pub(super) fn finish(&mut self) -> u64 {
        self.listener.handle_end();
        self.turns()
    }

    fn turns(&mut self) -> u64 {
        let mut turns = 0;
        while let Some(event) = self.listener.poll_event() {
            if event == HostEvent::Scan {
                turns += 1;
                self.first.get_or_insert_with(|| self.listener.scan().clone());
            }
        }
        turns
    }

    /// The mode of `model` that its turns are in.
    pub(super) fn mode(&self, model: &Model) -> Option<ScanMode> {
        let scan = self.first.as_ref()?;
        let centihz = (scan.scan_frequency_hz * 100.0).round() as u32;
        let is_mode = |mode: &&ScanMode| mode.frequency_centihz == centihz && mode.step == scan.beams.step;
        model.modes.iter().find(is_mode).copied()
    }
}
