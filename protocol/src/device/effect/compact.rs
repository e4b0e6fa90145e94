//! What variables of scanners with Compact output stand for, where that is not a value that is only kept.

use alloc::vec;
use alloc::vec::Vec;

use super::identity::on_for;
use super::scanning::switch_mode;
use crate::device::context::Context;
use crate::device::refusal::Fault;
use crate::device::variable::{Own, Value};
use crate::model::ScanMode;
use crate::telegram::{DateTime, SopasError, scdevicestate};

/// From Compact's and REST's angles, 0 straight ahead, to CoLa's, 1/10000°.
pub(in crate::device) const TO_COLA: i32 = 900_000;

/// What a variable of the device's own tells now.
pub(in crate::device) fn get(own: Own, context: &Context<'_>) -> Vec<Value> {
    match own {
        Own::Profile => profile(context),
        Own::ScanConfig => scan_config(context),
        Own::DeviceType => device_type(context),
        Own::OrderNumber => order_number(context),
        Own::DeviceStatus => device_status(context),
        Own::OperatingHours => operating_hours(context),
        Own::PowerOnCount => power_on_count(context),
        Own::Address => address(context),
        Own::DateTime => date_time(context),
    }
}

/// Sets it.
pub(in crate::device) fn set(own: Own, context: &mut Context<'_>, value: &[Value]) -> Result<(), SopasError> {
    match own {
        Own::Profile => set_profile(context, value),
        // Nobody writes these.
        _ => Err(Fault::ReadOnly.into()),
    }
}

fn number(number: impl Into<i64>) -> Vec<Value> {
    vec![Value::Number(number.into())]
}

fn profile(context: &Context<'_>) -> Vec<Value> {
    let device = &context.device;
    let place = device.model.modes.iter().position(|mode| *mode == device.settings.mode);
    number(place.map_or(0, |place| place as i64 + 1))
}

fn set_profile(context: &mut Context<'_>, value: &[Value]) -> Result<(), SopasError> {
    let number = value.first().map_or(0, Value::number);
    let place = usize::try_from(number - 1).map_err(|_| Fault::NoSuchCode)?;
    let mode = *context.device.model.modes.get(place).ok_or(Fault::NoSuchCode)?;
    switch_mode(context.device, mode);
    Ok(())
}

fn scan_config(context: &Context<'_>) -> Vec<Value> {
    let device = &context.device;
    let ScanMode { frequency_centihz, step } = device.settings.mode;
    let ends = [device.model.start_angle, device.model.stop_angle].map(|angle| i64::from(angle - TO_COLA));
    let all = [i64::from(frequency_centihz), 1, i64::from(step)].into_iter().chain(ends);
    all.map(Value::Number).collect()
}

fn device_type(context: &Context<'_>) -> Vec<Value> {
    vec![Value::Text(context.device.model.type_code.into())]
}

fn order_number(context: &Context<'_>) -> Vec<Value> {
    vec![Value::Text(context.device.model.order_number.into())]
}

fn device_status(context: &Context<'_>) -> Vec<Value> {
    let device = &context.device;
    number(match device.device_state(context.now, false) {
        scdevicestate::ERROR => 8,
        _ if device.is_settling(context.now) => 1,
        _ => 3,
    })
}

fn operating_hours(context: &Context<'_>) -> Vec<Value> {
    number(context.device.identity.operating_hours.wrapping_add(on_for(context)))
}

fn power_on_count(context: &Context<'_>) -> Vec<Value> {
    number(context.device.identity.power_on_count)
}

fn address(_: &Context<'_>) -> Vec<Value> {
    vec![Value::Address([192, 168, 0, 1])]
}

fn date_time(context: &Context<'_>) -> Vec<Value> {
    let DateTime { year, month, day, hour, minute, second, microsecond } =
        context.device.date_time(context.now);
    let small = [month, day, hour, minute, second].map(i64::from);
    let all = [i64::from(year)].into_iter().chain(small).chain([i64::from(microsecond)]);
    all.map(Value::Number).collect()
}
