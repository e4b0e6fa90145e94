//! A recorded picoScan or multiScan: how it was set, by its Compact telegrams.

use std::collections::VecDeque;
use std::time::Duration;

use rowscan_protocol::compact::{CompactListener, Telegram};
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model::{Model, ScanMode};
use rowscan_protocol::scan::{Scan, is_level};

use super::moment::Moment;

/// Turns that may be open at once.
const MAX_OPEN: usize = 16;

/// Where the turns of a stream begin: a turn is found once it is whole, and its first segment stands before that.
#[derive(Debug, Default)]
pub(super) struct TurnMoments {
    part: CompactPart,
    /// Turns by the number that scans have, and where their first segments stand.
    begins: VecDeque<(u16, Moment)>,
}

impl TurnMoments {
    /// Takes the next telegram, which stands there; where the turns begin that are whole with it.
    pub(super) fn take(&mut self, telegram: &[u8], at: Moment) -> impl Iterator<Item = Moment> {
        let turn = Telegram::decode(telegram).ok().and_then(|telegram| telegram.turn());
        if let Some(turn) = turn.map(|turn| turn as u16)
            && !self.begins.iter().any(|(begun, _)| *begun == turn)
        {
            self.begins.truncate(MAX_OPEN - 1);
            self.begins.push_front((turn, at));
        }
        let whole = self.part.take(telegram);
        self.moments(whole, at)
    }

    /// No more telegrams come; where the turns begin that are whole now.
    pub(super) fn finish(&mut self) -> impl Iterator<Item = Moment> {
        let whole = self.part.finish();
        self.moments(whole, Moment::END)
    }

    fn moments(&mut self, whole: Vec<u16>, otherwise: Moment) -> impl Iterator<Item = Moment> {
        let begins = |turn: &u16| self.begins.iter().find(|(begun, _)| begun == turn);
        let moments: Vec<Moment> =
            whole.iter().map(|turn| begins(turn).map_or(otherwise, |(_, at)| *at)).collect();
        // A device that begins anew gives its numbers again.
        self.begins.retain(|(begun, _)| !whole.contains(begun));
        moments.into_iter()
    }
}

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
    /// Takes the next telegram; the numbers of the turns that are whole with it.
    pub(super) fn take(&mut self, telegram: &[u8]) -> Vec<u16> {
        self.listener.handle_datagram(Duration::ZERO, telegram);
        self.turns()
    }

    /// No more telegrams come; the numbers of the turns that are whole now.
    pub(super) fn finish(&mut self) -> Vec<u16> {
        self.listener.handle_end();
        self.turns()
    }

    fn turns(&mut self) -> Vec<u16> {
        let mut turns = Vec::new();
        while let Some(event) = self.listener.poll_event() {
            if event != HostEvent::Scan {
                continue;
            }
            let scan = self.listener.scan();
            // A turn counts once, with the first of its lines.
            if self.turn.replace(scan.scan_counter) != Some(scan.scan_counter) {
                turns.push(scan.scan_counter);
            }
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
