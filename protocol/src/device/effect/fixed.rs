//! What can be read, and written only as it is: network and time server belong to the host program's machine, and a scanner here measures from
//! power-up on.

use crate::device::context::{Context, Readable};
use crate::telegram::ei_address::{Gateway, IpAddress, NetworkMask};
use crate::telegram::lmp_autostartmeas::StartsByItself;
use crate::telegram::tsc_time_client::{
    TimeDelay, TimeInterface, TimeOffset, TimeRole, TimeServer, TimeUpdate, TimeZone,
};

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

impl Readable for TimeZone {
    /// Universal time.
    fn get(_: &Context<'_>) -> Self {
        Self { hours_plus_12: 12 }
    }
}

impl Readable for TimeOffset {
    /// No server was ever asked.
    fn get(_: &Context<'_>) -> Self {
        Self { seconds: 0.0 }
    }
}

impl Readable for TimeDelay {
    fn get(_: &Context<'_>) -> Self {
        Self { seconds: 0.0 }
    }
}

impl Readable for StartsByItself {
    fn get(_: &Context<'_>) -> Self {
        Self { on: true }
    }
}
