//! What a request says.

use axum::body::Bytes;
use axum::extract::{FromRequest, Request};
use rowscan_faults::{FaultError, FaultSpec};
use rowscan_settings::Table;
use serde::Deserialize;
use serde_json::Value;

use crate::problem::Problem;

/// The bytes of a body; one that is too long is refused as everything else is.
pub(crate) struct Body(pub(crate) Bytes);

impl<S: Send + Sync> FromRequest<S> for Body {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        let bytes = Bytes::from_request(request, state).await;
        bytes.map(Self).map_err(|rejection| Problem::new(rejection.status(), rejection.body_text()))
    }
}

/// Reads a JSON body, whatever type it claims to have.
pub(crate) fn body<'a, T: Deserialize<'a>>(Body(bytes): &'a Body) -> Result<T, Problem> {
    serde_json::from_slice(bytes)
        .map_err(|error| Problem::wrong(format!("the body is not what is expected: {error}")))
}

/// What is wrong with a fault.
pub(crate) fn of_fault(error: &FaultError) -> Problem {
    match error {
        FaultError::Unknown { .. } => Problem::missing(error.to_string()),
        FaultError::SameId(_) => Problem::conflict(error.to_string()),
        _ => Problem::wrong(error.to_string()),
    }
}

/// A fault as the table of a file has it.
pub(crate) fn spec(table: Value) -> Result<FaultSpec, Problem> {
    let table: Table = serde_json::from_value(table).map_err(|error| Problem::wrong(error.to_string()))?;
    FaultSpec::from_table(&table).map_err(|error| Problem::wrong(error.message))
}
