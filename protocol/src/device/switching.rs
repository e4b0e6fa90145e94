//! Switching digital inputs and outputs, and evaluating the field.

use super::lines::{Changes, Field, UNUSED, set};
use super::measured::MeasuredLine;
use super::state::Device;
use crate::telegram::lfe_rec;
use crate::time::SimTime;

/// A digital line the model does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{model} has {lines} digital {kind}; there is no number {number}")]
#[non_exhaustive]
pub struct DigitalLineError {
    /// The model.
    pub model: &'static str,
    /// `inputs` or `outputs`.
    pub kind: &'static str,
    /// How many there are.
    pub lines: usize,
    /// The one asked for, from 1.
    pub number: u8,
}

impl Device {
    /// Switches digital input `number`, from 1.
    pub fn set_input(&mut self, now: SimTime, number: u8, on: bool) -> Result<(), DigitalLineError> {
        let uptime_us = self.uptime_us(now);
        let error = DigitalLineError {
            model: self.model.title,
            kind: "inputs",
            lines: self.lines.inputs.len(),
            number,
        };
        let input = index(number).and_then(|index| self.lines.inputs.get_mut(index)).ok_or(error)?;
        if core::mem::replace(input, on.into()) != u8::from(on) {
            self.lines.changes.inputs.now(uptime_us);
        }
        Ok(())
    }

    /// Switches digital output `number`, from 1.
    pub fn set_output(&mut self, now: SimTime, number: u8, on: bool) -> Result<(), DigitalLineError> {
        let uptime_us = self.uptime_us(now);
        let usable = |state: u8| state != UNUSED;
        let lines = self.lines.outputs.iter().filter(|output| usable(output.state)).count();
        let error = DigitalLineError { model: self.model.title, kind: "outputs", lines, number };
        let output = index(number).and_then(|index| self.lines.outputs.get_mut(index));
        let output = output.filter(|output| usable(output.state)).ok_or(error)?;
        if set(output, on.into()) {
            self.lines.changes.outputs.now(uptime_us);
        }
        let bit = 1u8.checked_shl(u32::from(number) - 1).unwrap_or_default();
        self.lines.output_mask =
            if on { self.lines.output_mask | bit } else { self.lines.output_mask & !bit };
        Ok(())
    }

    /// Sets evaluation field 1, a circle about the scanner; `None` takes it away. Anything nearer infringes it.
    pub fn watch_field(&mut self, radius_mm: Option<u16>) {
        self.lines.field = Field { radius_mm, result: lfe_rec::INVALID };
    }

    /// How often digital lines and fields have changed: when this number changes, there are events for subscribers.
    pub fn changes(&self) -> u32 {
        let Changes { inputs, outputs, field } = self.lines.changes;
        inputs.count.wrapping_add(outputs.count).wrapping_add(field.count)
    }

    pub(super) fn switch_outputs(&mut self, now: SimTime, running: bool) {
        let uptime_us = self.uptime_us(now);
        self.lines.switch_outputs(self.model, running, uptime_us);
    }

    /// Checks whether anything is in the field.
    pub(super) fn evaluate_field(&mut self, now: SimTime, line: &MeasuredLine<'_>) {
        let Some(radius_mm) = self.lines.field.radius_mm else { return };
        let result = match line.nearest_mm() {
            _ if !self.settings.applications.evaluation => lfe_rec::INVALID,
            Some(nearest_mm) if nearest_mm <= radius_mm => lfe_rec::INFRINGED,
            _ => lfe_rec::FREE,
        };
        if core::mem::replace(&mut self.lines.field.result, result) != result {
            let uptime_us = self.uptime_us(now);
            self.lines.changes.field.now(uptime_us);
        }
    }
}

fn index(number: u8) -> Option<usize> {
    usize::from(number).checked_sub(1)
}
