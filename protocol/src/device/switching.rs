//! Switching digital inputs and outputs, and evaluating the fields.

use super::lines::{Changes, Field, UNUSED, set};
use super::measured::MeasuredLine;
use super::state::Device;
use crate::model::Evaluations;
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

/// More evaluation fields than the model has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{model} evaluates {most} fields at most, found {found}")]
#[non_exhaustive]
pub struct FieldError {
    /// The model.
    pub model: &'static str,
    /// How many it evaluates.
    pub most: u8,
    /// How many were to be set.
    pub found: usize,
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

    /// Sets the evaluation fields, from field 1 on: circles about the scanner with these radii. Anything nearer infringes a field. Where the
    /// model always reports some number of fields, those without a radius are not evaluated.
    pub fn watch_fields(&mut self, radii_mm: &[u16]) -> Result<(), FieldError> {
        let Evaluations { always, most } = self.model.evaluations;
        if radii_mm.len() > usize::from(most) {
            return Err(FieldError { model: self.model.title, most, found: radii_mm.len() });
        }
        let fields = radii_mm.len().max(always.into());
        self.lines.fields = (0..fields).map(|index| Field::new(radii_mm.get(index).copied())).collect();
        Ok(())
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

    /// Checks whether anything is in the fields.
    pub(super) fn evaluate_fields(&mut self, now: SimTime, line: &MeasuredLine<'_>) {
        let uptime_us = self.uptime_us(now);
        let evaluates = self.settings.applications.evaluation;
        // Not looked for where nobody asks.
        let nearest_mm = if self.lines.fields.is_empty() { None } else { line.nearest_mm() };
        let mut changed = false;
        for field in &mut self.lines.fields {
            let Some(radius_mm) = field.radius_mm else { continue };
            let result = match nearest_mm {
                _ if !evaluates => lfe_rec::INVALID,
                Some(nearest_mm) if nearest_mm <= radius_mm => lfe_rec::INFRINGED,
                _ => lfe_rec::FREE,
            };
            if core::mem::replace(&mut field.result, result) != result {
                field.at_us = uptime_us;
                changed = true;
            }
        }
        if changed {
            self.lines.changes.field.now(uptime_us);
        }
    }
}

fn index(number: u8) -> Option<usize> {
    usize::from(number).checked_sub(1)
}
