//! Digital inputs and outputs, field results, applications.

use alloc::vec;

use crate::device::context::{Context, Readable, Writable};
use crate::device::lines::{Change, Field};
use crate::device::refusal::Fault;
use crate::telegram::SopasError;
use crate::telegram::lfe_rec::{FieldResult, FieldResults};
use crate::telegram::lid_inputstate::InputState;
use crate::telegram::lid_outputstate::OutputStates;
use crate::telegram::set_active_applications::{ActiveApplications, Application};
use crate::telegram::wire::FixedText;

/// Ranging.
const RANGING: FixedText<4> = FixedText(*b"RANG");
/// Field evaluation.
const EVALUATION: FixedText<4> = FixedText(*b"FEVL");

impl Readable for InputState {
    /// Timed models report when an input last changed; until then, when the inputs were first read.
    fn get(context: &Context<'_>) -> Self {
        let device = &context.device;
        let at_us = match device.lines.changes.inputs {
            Change { count: 0, .. } => {
                device.uptime_us(context.now).min(device.model.lines.inputs_read_us.into())
            }
            Change { at_us, .. } => at_us,
        };
        let timed = device.model.lines.inputs_timed;
        Self {
            version: device.model.lines.version,
            time_us: if timed { at_us as u32 } else { 0 },
            inputs: device.lines.inputs,
            date_time: timed.then(|| device.date_time_at(at_us)),
        }
    }
}

impl Readable for OutputStates {
    fn get(context: &Context<'_>) -> Self {
        let device = &context.device;
        let at_us = device.lines.changes.outputs.at_us;
        Self {
            version: device.model.lines.version,
            time_us: at_us as u32,
            outputs: device.lines.outputs.clone(),
            date_time: Some(device.date_time_at(at_us)),
        }
    }
}

impl Readable for FieldResults {
    /// One result a field, with the time of the field's own last change, as recorded on a TiM781S. Models that do not time their inputs do
    /// not time this either.
    fn get(context: &Context<'_>) -> Self {
        let device = &context.device;
        let timed = device.model.lines.inputs_timed;
        let beams = device.mirror().beams;
        let result = |(field, number): (&Field, u8)| FieldResult {
            version: 1,
            field: number,
            time_us: if timed { field.at_us as u32 } else { 0 },
            scale: 1.0,
            step: beams.step.into(),
            start_angle: beams.start,
            result: field.result,
            date_time: Some(device.date_time_at(field.at_us)),
            ..FieldResult::default()
        };
        Self { fields: device.lines.fields.iter().zip(1..).map(result).collect() }
    }
}

impl Readable for ActiveApplications {
    fn get(context: &Context<'_>) -> Self {
        let applications = context.device.settings.applications;
        Self {
            applications: vec![
                Application { name: RANGING, active: applications.ranging },
                Application { name: EVALUATION, active: applications.evaluation },
            ],
        }
    }
}

impl Writable for ActiveApplications {
    /// Those not named stay as they are.
    fn set(self, context: &mut Context<'_>) -> Result<(), SopasError> {
        let mut applications = context.device.settings.applications;
        for Application { name, active } in self.applications {
            let switch = match name {
                RANGING => &mut applications.ranging,
                EVALUATION => &mut applications.evaluation,
                _ => return Err(Fault::NoSuchApplication.into()),
            };
            *switch = active;
        }
        context.device.settings.applications = applications;
        Ok(())
    }
}
