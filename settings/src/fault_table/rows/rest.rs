//! What a REST interface refuses.

use crate::fault_table::device::{DeviceFault, RestFault};
use crate::fault_table::part_fault::PartFault;
use crate::fault_table::row::{Family, Row};

/// Nonces that are of no use any more.
pub(super) const STALE: Row = Row {
    name: "nonce_stale",
    family: Family::Device,
    parameters: &[],
    about: "Every nonce of the REST interface has gone stale when it is used: status 10, HTTP 401. No login counts as failed.",
    reports: "refusal in words",
    recovery: "a new challenge, once; then told",
    make: |_| Ok(PartFault::Device(DeviceFault::Rest(RestFault::StaleNonces))),
};

/// Too many requests.
pub(super) const TOO_MANY: Row = Row {
    name: "too_many_requests",
    family: Family::Device,
    parameters: &[],
    about: "The REST interface answers every POST with status 11, HTTP 429.",
    reports: "refusal in words",
    recovery: "retries after pauses; then told",
    make: |_| Ok(PartFault::Device(DeviceFault::Rest(RestFault::TooMany))),
};
