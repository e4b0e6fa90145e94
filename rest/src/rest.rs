//! The interface without I/O: a request and the device in, an answer out.

use rowscan_protocol::device::variable::{Access, Variable};
use rowscan_protocol::device::{Device, RestTrouble};
use rowscan_protocol::telegram::SopasError;
use rowscan_protocol::time::SimTime;
use serde_json::{Map, Value, json};

use crate::answer::{Answer, Status};
use crate::json;
use crate::login::Login;
use crate::method::METHODS;
use crate::schema::NOT_MODELLED;

/// What a request wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verb {
    /// To read.
    Get,
    /// To write or to call.
    Post,
}

/// A request, as it has come.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// What it wants.
    pub verb: Verb,
    /// What follows `/api/`.
    pub name: &'a str,
    /// The body; its type is not asked for, for SICK's Python client does not say it.
    pub body: &'a [u8],
}

/// The REST interface of one scanner.
#[derive(Debug)]
pub struct Rest {
    login: Login,
}

impl Rest {
    /// Of the scanner with this serial number; challenges repeat with the seed.
    pub fn new(seed: u64, serial_number: u32) -> Self {
        Self { login: Login::new(seed, serial_number) }
    }

    /// Answers a request.
    pub fn answer(&mut self, request: &Request<'_>, device: &mut Device, now: SimTime) -> Answer {
        if device.is_silent(now) {
            return Status::InternalError.into();
        }
        let answered = match request.verb {
            Verb::Get => get(request.name, device, now),
            Verb::Post => self.post(request, device, now),
        };
        answered.unwrap_or_else(Answer::from)
    }

    fn post(&mut self, request: &Request<'_>, device: &mut Device, now: SimTime) -> Result<Answer, Status> {
        let Request { name, body, .. } = *request;
        let body: Value = serde_json::from_slice(body).map_err(|_| Status::ParsingFailed)?;
        let body = body.as_object().ok_or(Status::ParsingFailed)?;
        let data = body.get("data").cloned().unwrap_or_else(|| json!({}));
        let trouble = device.rest_trouble();
        if trouble == Some(RestTrouble::TooMany) {
            return Err(Status::TooMany);
        }
        if name == "getChallenge" {
            let user = data.get("user").and_then(Value::as_str).ok_or(Status::InvalidData)?;
            return self.login.challenge(user, now).map(Answer::challenge);
        }
        let known = known(name, device);
        let method = METHODS.iter().find(|method| method.name == name);
        if known.is_none() && method.is_none() {
            return Err(unknown(name));
        }
        if trouble.is_some() {
            return Err(Status::InvalidChallenge);
        }
        self.login.judge(body.get("header").unwrap_or(&Value::Null), name, now)?;
        if let Some(method) = method {
            let action = (method.action)(&data)?;
            return Ok(Answer::data((method.result)(action.is_none_or(|action| device.act(action, now)))));
        }
        let variable = known.ok_or(Status::NotFound)?;
        if variable.access == Access::ReadOnly {
            return Err(Status::ReadOnly);
        }
        let written = data.get(name).ok_or(Status::InvalidData)?;
        let value = json::to_value(variable, written)?;
        if !variable.takes(device.model(), &value) {
            return Err(Status::OutOfRange);
        }
        device.set_value(variable, value, now).map_err(refused)?;
        Ok(Answer::from(Status::Ok))
    }
}

/// Reads a variable: in `data`, by its name.
fn get(name: &str, device: &mut Device, now: SimTime) -> Result<Answer, Status> {
    let variable = known(name, device).ok_or_else(|| unknown(name))?;
    let value = device.value(variable, now).map_err(refused)?;
    let mut data = Map::new();
    data.insert(name.to_owned(), json::of_value(variable, &value));
    Ok(Answer::data(data.into()))
}

fn known(name: &str, device: &Device) -> Option<&'static Variable> {
    device.variable(name)
}

/// Why a name is not answered: the schema has it, or nothing has.
fn unknown(name: &str) -> Status {
    if NOT_MODELLED.contains(&name) || METHODS.iter().any(|method| method.name == name) {
        Status::ParsingFailed
    } else {
        Status::NotFound
    }
}

/// CoLa's refusal in REST's words.
fn refused(error: SopasError) -> Status {
    match error {
        SopasError::LocalConditionFailed => Status::IllegalValue,
        SopasError::FlexOutOfBounds => Status::OutOfBounds,
        SopasError::WriteAccessDenied => Status::ReadOnly,
        SopasError::UnknownVariable => Status::NotFound,
        _ => Status::InvalidData,
    }
}
