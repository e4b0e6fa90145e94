//! A recorded picoScan or multiScan: how it was set, by its Compact telegrams.

use std::time::Duration;

use rowscan_protocol::compact::CompactListener;
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model::{Model, ScanMode};
use rowscan_protocol::scan::{Scan, is_level};

/// What the recorded datagrams of a stream tell of their device.
#[derive(Debug, Default)]
pub struct CompactPart {
    listener: CompactListener,
    /// The level line of the first turn that has one, or any until then.
    pub(super) first: Option<Scan>,
    /// The turn whose line was given last.
    turn: Option<u16>,
    /// Lines of several layers were seen.
    has_layers: bool,
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
            if event != HostEvent::Scan {
                continue;
            }
            let scan = self.listener.scan();
            // A turn counts once, with the first of its lines.
            turns += u64::from(self.turn.replace(scan.scan_counter) != Some(scan.scan_counter));
            self.has_layers |= !is_level(scan.layer_centideg);
            if self
                .first
                .as_ref()
                .is_none_or(|first| !is_level(first.layer_centideg) && is_level(scan.layer_centideg))
            {
                self.first = Some(scan.clone());
            }
        }
        turns
    }

    /// The mode of `model` that its turns are in.
    pub(super) fn mode(&self, model: &Model) -> Option<ScanMode> {
        let scan = self.first.as_ref()?;
        let layers = model.compact.map_or(&[][..], |compact| compact.layers);
        if self.has_layers && layers.is_empty() {
            return None;
        }
        let centihz = (scan.scan_frequency_hz * 100.0).round() as u32;
        // A filter may have left any of several layers.
        let has_step = |mode: &ScanMode| {
            let is_of = |step| step == scan.beams.step;
            if layers.is_empty() { is_of(mode.step) } else { layers.iter().any(|layer| is_of(layer.step)) }
        };
        model.modes.iter().find(|mode| mode.frequency_centihz == centihz && has_step(mode)).copied()
    }
}
