//! What can be read, and written only as it is: network and time server belong to the host program's machine.

use crate::device::context::{Context, Readable};
use crate::telegram::ei_address::{Gateway, IpAddress, NetworkMask};
use crate::telegram::tsc_time_client::{TimeInterface, TimeRole, TimeServer, TimeUpdate};

impl Readable for IpAddress {
    /// As delivered.
    fn get(_: &Context<'_>) -> Self {
        Self { address: [192, 168, 0, 1] }
    }
}

impl Readable for NetworkMask {
    fn get(_: &Context<'_>) -> Self {
        Self { mask: [255, 255, 255, 0] }
    }
}

impl Readable for Gateway {
    fn get(_: &Context<'_>) -> Self {
        Self { address: [0, 0, 0, 0] }
    }
}

impl Readable for TimeRole {
    /// No time server.
    fn get(_: &Context<'_>) -> Self {
        Self { code: 0 }
    }
}

impl Readable for TimeInterface {
    fn get(_: &Context<'_>) -> Self {
        Self { code: 0 }
    }
}

impl Readable for TimeServer {
    fn get(_: &Context<'_>) -> Self {
        Self { address: [0, 0, 0, 0] }
    }
}

impl Readable for TimeUpdate {
    /// Not verified.
    fn get(_: &Context<'_>) -> Self {
        Self { seconds: 10 }
    }
}
