//! State of the digital inputs, the outputs and the evaluation fields, and how often each has changed.

use alloc::vec::Vec;

use crate::model::Model;
use crate::telegram::lfe_rec;
use crate::telegram::lid_outputstate::OutputState;

/// A digital line that is not on any connector.
pub(super) const UNUSED: u8 = 2;

/// Digital lines as they are now.
#[derive(Clone, Debug)]
pub(super) struct Lines {
    pub(super) inputs: [u8; 4],
    pub(super) outputs: Vec<OutputState>,
    /// Bit mask of the outputs in scan telegrams.
    pub(super) output_mask: u8,
    /// Evaluation field 1 and on.
    pub(super) fields: Vec<Field>,
    pub(super) changes: Changes,
}

/// An evaluation field: a circle about the scanner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Field {
    /// None where the field is not set: it is not evaluated.
    pub(super) radius_mm: Option<u16>,
    /// One of LFErec's codes.
    pub(super) result: u8,
    /// When the result last changed, µs since power-up.
    pub(super) at_us: u64,
}

impl Field {
    pub(super) fn new(radius_mm: Option<u16>) -> Self {
        Self { radius_mm, result: lfe_rec::INVALID, at_us: 0 }
    }
}

/// How often and when each kind last changed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Changes {
    pub(super) inputs: Change,
    pub(super) outputs: Change,
    pub(super) field: Change,
}

/// One kind's changes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Change {
    pub(super) count: u32,
    /// Time of the last one, µs since power-up.
    pub(super) at_us: u64,
}

impl Changes {
    /// The same counts for a clock that restarts at zero.
    pub(super) fn since_power_up(self) -> Self {
        let counted = |change: Change| Change { at_us: 0, ..change };
        Self { inputs: counted(self.inputs), outputs: counted(self.outputs), field: counted(self.field) }
    }
}

impl Change {
    pub(super) fn now(&mut self, uptime_us: u64) {
        self.count = self.count.wrapping_add(1);
        self.at_us = uptime_us;
    }
}

impl Lines {
    pub(super) fn new(model: &Model) -> Self {
        let outputs = model.lines.outputs.iter().map(|&state| OutputState { state, changes: 0 });
        Self {
            inputs: model.lines.inputs,
            outputs: outputs.collect(),
            output_mask: model.outputs,
            fields: (0..model.evaluations.always).map(|_| Field::new(None)).collect(),
            changes: Changes::default(),
        }
    }

    /// Bit mask of the inputs in scan telegrams.
    pub(super) fn input_mask(&self) -> u8 {
        let bits = self.inputs.iter().enumerate();
        bits.fold(0, |mask, (bit, &state)| mask | u8::from(state == 1) << bit)
    }

    /// Outputs as they stand while measuring starts, and once it runs.
    pub(super) fn switch_outputs(&mut self, model: &Model, running: bool, uptime_us: u64) {
        let states = model.lines.outputs.iter();
        let mut changed = false;
        for (output, &state) in self.outputs.iter_mut().zip(states) {
            let state = if state == 1 && !running { 0 } else { state };
            changed |= set(output, state);
        }
        self.output_mask = if running { model.outputs } else { model.start_up.outputs };
        if changed {
            self.changes.outputs.now(uptime_us);
        }
    }
}

pub(super) fn set(output: &mut OutputState, state: u8) -> bool {
    let changed = output.state != state;
    output.state = state;
    output.changes = output.changes.wrapping_add(changed.into());
    changed
}
