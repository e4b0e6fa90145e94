//! Methods: called by POST, their results directly in `data`.

use rowscan_protocol::device::Action;
use rowscan_protocol::telegram::DateTime;
use serde_json::{Value, json};

use crate::answer::Status;

/// One method.
pub(crate) struct Method {
    pub(crate) name: &'static str,
    /// What it does, by the data of its call.
    pub(crate) action: fn(&Value) -> Result<Option<Action>, Status>,
    /// What it answers, if that was possible.
    pub(crate) result: fn(bool) -> Value,
}

/// One line a method; all of them need a login.
pub(crate) static METHODS: &[Method] = &[
    Method { name: "mStartMeasure", action: |_| Ok(Some(Action::Start)), result: error_code },
    Method { name: "mStopMeasure", action: |_| Ok(Some(Action::Stop)), result: error_code },
    Method { name: "mStandby", action: |_| Ok(Some(Action::Standby)), result: error_code },
    Method {
        name: "WriteEeprom",
        action: |_| Ok(Some(Action::Save)),
        result: |done| json!({ "Success": done }),
    },
    Method { name: "SoftReset", action: |_| Ok(Some(Action::Restart)), result: |_| json!({}) },
    Method { name: "RebootDevice", action: |_| Ok(Some(Action::SaveAndRestart)), result: |_| json!({}) },
    Method { name: "LoadFactoryDefaults", action: |_| Ok(Some(Action::Deliver)), result: |_| json!({}) },
    Method { name: "LSPsetdatetime", action: date_time, result: error_code },
    // Does nothing but to be allowed.
    Method { name: "checkCredentials", action: |_| Ok(None), result: |_| json!({}) },
];

/// SOPAS_ERR_NO_ERR, or SOPAS_ERR_STATE_CHANGE_NOT_PERMITTED.
fn error_code(done: bool) -> Value {
    json!({ "ErrorCode": u8::from(!done) })
}

fn date_time(data: &Value) -> Result<Option<Action>, Status> {
    let told = data.get("DateTime").ok_or(Status::InvalidData)?;
    let number = |key| {
        let told = told.get(key).and_then(Value::as_u64).ok_or(Status::InvalidData)?;
        u32::try_from(told).map_err(|_| Status::OutOfRange)
    };
    let byte = |key| u8::try_from(number(key)?).map_err(|_| Status::OutOfRange);
    Ok(Some(Action::SetDateTime(DateTime {
        year: u16::try_from(number("uiYear")?).map_err(|_| Status::OutOfRange)?,
        month: byte("usiMonth")?,
        day: byte("usiDay")?,
        hour: byte("usiHour")?,
        minute: byte("usiMinute")?,
        second: byte("usiSec")?,
        microsecond: number("udiUSec")?,
    })))
}
