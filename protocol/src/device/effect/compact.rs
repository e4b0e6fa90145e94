//! What variables of scanners with Compact output stand for, where that is not a value that is only kept.

use alloc::vec;
use alloc::vec::Vec;

use super::identity::on_for;
use super::scanning::switch_mode;
use crate::device::context::Context;
use crate::device::refusal::Fault;
use crate::device::variable::Value;
use crate::model::ScanMode;
use crate::telegram::{DateTime, SopasError, scdevicestate};

/// From Compact's and REST's angles, 0 straight ahead, to CoLa's, 1/10000°.
pub(in crate::device) const TO_COLA: i32 = 900_000;

fn number(number: impl Into<i64>) -> Vec<Value> {
    vec![Value::Number(number.into())]
}

pub(in crate::device) fn profile(context: &Context<'_>) -> Vec<Value> {
    let device = &context.device;
    let place = device.model.modes.iter().position(|mode| *mode == device.settings.mode);
    number(place.map_or(0, |place| place as i64 + 1))
}

pub(in crate::device) fn set_profile(context: &mut Context<'_>, value: &[Value]) -> Result<(), SopasError> {
    let number = value.first().map_or(0, Value::number);
    let place = usize::try_from(number - 1).map_err(|_| Fault::NoSuchCode)?;
    let mode = *context.device.model.modes.get(place).ok_or(Fault::NoSuchCode)?;
    switch_mode(context.device, mode);
    Ok(())
}

pub(in crate::device) fn scan_config(context: &Context<'_>) -> Vec<Value> {
    let device = &context.device;
    let ScanMode { frequency_centihz, step } = device.settings.mode;
    let ends = [device.model.start_angle, device.model.stop_angle].map(|angle| i64::from(angle - TO_COLA));
    let all = [i64::from(frequency_centihz), 1, i64::from(step)].into_iter().chain(ends);
    all.map(Value::Number).collect()
}

pub(in crate::device) fn device_type(context: &Context<'_>) -> Vec<Value> {
    vec![Value::Text(context.device.model.type_code.into())]
}

pub(in crate::device) fn order_number(context: &Context<'_>) -> Vec<Value> {
    vec![Value::Text(context.device.model.order_number.into())]
}

pub(in crate::device) fn device_status(context: &Context<'_>) -> Vec<Value> {
    let device = &context.device;
    number(match device.device_state(context.now, false) {
        scdevicestate::ERROR => 8,
        _ if device.is_settling(context.now) => 1,
        _ => 3,
    })
}

pub(in crate::device) fn operating_hours(context: &Context<'_>) -> Vec<Value> {
    number(context.device.identity.operating_hours.wrapping_add(on_for(context)))
}

pub(in crate::device) fn power_on_count(context: &Context<'_>) -> Vec<Value> {
    number(context.device.identity.power_on_count)
}

pub(in crate::device) fn address(_: &Context<'_>) -> Vec<Value> {
    vec![Value::Address([192, 168, 0, 1])]
}

pub(in crate::device) fn date_time(context: &Context<'_>) -> Vec<Value> {
    let DateTime { year, month, day, hour, minute, second, microsecond } =
        context.device.date_time(context.now);
    let small = [month, day, hour, minute, second].map(i64::from);
    let all = [i64::from(year)].into_iter().chain(small).chain([i64::from(microsecond)]);
    all.map(Value::Number).collect()
}

/// Nobody writes it.
pub(in crate::device) fn nobody(_: &mut Context<'_>, _: &[Value]) -> Result<(), SopasError> {
    Err(Fault::ReadOnly.into())
}
