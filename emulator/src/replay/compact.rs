//! A recorded picoScan: how it was set, by its Compact telegrams.

use std::time::Duration;

use rowscan_protocol::compact::CompactListener;
use rowscan_protocol::device::{Device, Identity};
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model::{Model, SEGMENTED, ScanMode};
use rowscan_protocol::scan::Scan;

use super::{Part, ReplayError, Survey};

/// What the recorded datagrams of a stream tell of their device.
#[derive(Debug, Default)]
pub struct CompactPart {
    listener: CompactListener,
    /// The first turn.
    first: Option<Scan>,
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
    fn mode(&self, model: &Model) -> Option<ScanMode> {
        let scan = self.first.as_ref()?;
        let centihz = (scan.scan_frequency_hz * 100.0).round() as u32;
        let is_mode = |mode: &&ScanMode| mode.frequency_centihz == centihz && mode.step == scan.beams.step;
        model.modes.iter().find(is_mode).copied()
    }
}

/// The scanner of recorded datagrams: the model asked for, the one that the recording tells, or the first one that has such turns.
pub fn compact_model_of(
    survey: &Survey,
    part: &Part,
    asked: Option<&'static Model>,
) -> Result<&'static Model, ReplayError> {
    let told = || SEGMENTED.iter().find(|model| Some(model.name) == survey.about.model.as_deref()).copied();
    let by_turns = || SEGMENTED.iter().find(|model| part.compact.mode(model).is_some()).copied();
    let model = asked.or_else(told).or_else(by_turns);
    model.filter(|model| part.compact.mode(model).is_some()).ok_or_else(|| ReplayError::UnknownModel {
        found: part.compact.first.as_ref().map_or_else(
            || "nameless and sends no whole turn".to_owned(),
            |scan| {
                let step_deg = scan.beams.step_deg();
                format!(
                    "nameless and turns {:.2} times a second with beams of {step_deg:.3}°",
                    scan.scan_frequency_hz
                )
            },
        ),
    })
}

/// The device that answers in the place of the recorded one, set as that was.
pub fn compact_device_of(part: &Part, model: &'static Model) -> Device {
    let mut device = Device::new(model, Identity::of(model, 0));
    if let (Some(scan), Some(mode)) = (&part.compact.first, part.compact.mode(model)) {
        device.play_back_turns(scan.serial_number, mode, scan.echoes.len());
    }
    device
}
