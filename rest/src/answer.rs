//! Answers: `header.status` with its words, and the code of HTTP.

use serde_json::{Map, Value, json};

/// What `header.status` says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// 0.
    Ok,
    /// 1: the body is no JSON object, or the name is the schema's and not modelled here.
    ParsingFailed,
    /// 2: a member is missing or of another type.
    InvalidData,
    /// 3: the device starts up.
    InternalError,
    /// 4: the user is not enabled.
    AccessDenied,
    /// 5: no such name.
    NotFound,
    /// 6: a number beyond the range.
    OutOfRange,
    /// 7: a text or list of the wrong length.
    OutOfBounds,
    /// 8: nobody writes it.
    ReadOnly,
    /// 9: a value that the variable does not have.
    IllegalValue,
    /// 10: the nonce is stale, or the response is wrong.
    InvalidChallenge,
    /// 11: too many requests, or too many failed logins.
    TooMany,
}

impl Status {
    fn row(self) -> (u16, &'static str, u16) {
        match self {
            Self::Ok => (0, "Ok", 200),
            Self::ParsingFailed => (1, "Parsing Failed", 400),
            Self::InvalidData => (2, "Invalid Data", 400),
            Self::InternalError => (3, "Internal Server Error", 503),
            Self::AccessDenied => (4, "Access Denied", 403),
            Self::NotFound => (5, "Not Found", 404),
            Self::OutOfRange => (6, "Out Of Range", 400),
            Self::OutOfBounds => (7, "Out Of Bounds", 400),
            Self::ReadOnly => (8, "Read Only", 400),
            Self::IllegalValue => (9, "Illegal Value", 400),
            Self::InvalidChallenge => (10, "Invalid Challenge", 401),
            Self::TooMany => (11, "Out Of Connections", 429),
        }
    }

    /// The number.
    pub fn code(self) -> u16 {
        self.row().0
    }
}

/// An answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The code of HTTP. SICK's own clients go by `header.status`; of other codes than 200, 401, 403 and 429 it is not known what real devices send.
    pub http: u16,
    /// The body.
    pub body: Value,
}

impl Answer {
    fn new(status: Status, more: impl IntoIterator<Item = (&'static str, Value)>) -> Self {
        let (code, message, http) = status.row();
        let mut body = Map::new();
        body.insert("header".into(), json!({ "status": code, "message": message }));
        body.extend(more.into_iter().map(|(key, value)| (key.into(), value)));
        Self { http, body: body.into() }
    }

    /// Everything is well, and this is it.
    pub(crate) fn data(data: Value) -> Self {
        Self::new(Status::Ok, [("data", data)])
    }

    /// A challenge: it stands beside the header.
    pub(crate) fn challenge(challenge: Value) -> Self {
        Self::new(Status::Ok, [("challenge", challenge)])
    }
}

impl From<Status> for Answer {
    fn from(status: Status) -> Self {
        Self::new(status, [])
    }
}
