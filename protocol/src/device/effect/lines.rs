//! Digital inputs and outputs. They never change here.

use crate::device::command::{Context, Readable};
use crate::telegram::lid_inputstate::InputState;
use crate::telegram::lid_outputstate::{OutputState, OutputStates};

impl Readable for InputState {
    fn get(context: &Context<'_>) -> Self {
        let lines = &context.device.model.lines;
        let timed = lines.inputs_timed;
        Self {
            version: lines.version,
            time_us: if timed { context.device.uptime_us(context.now) as u32 } else { 0 },
            inputs: lines.inputs,
            date_time: timed.then(|| context.device.date_time(context.now)),
        }
    }
}

impl Readable for OutputStates {
    fn get(context: &Context<'_>) -> Self {
        let lines = &context.device.model.lines;
        Self {
            version: lines.version,
            time_us: context.device.uptime_us(context.now) as u32,
            outputs: lines.outputs.iter().map(|&state| OutputState { state, changes: 0 }).collect(),
            date_time: Some(context.device.date_time(context.now)),
        }
    }
}
