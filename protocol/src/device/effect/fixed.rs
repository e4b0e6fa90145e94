//! What can be read, and written only as it is: network and time server belong to the host program's machine, and a scanner here measures from
//! power-up on.

use crate::device::context::{Context, Readable};
use crate::telegram::ei_address::{Gateway, IpAddress, NetworkMask};
use crate::telegram::lmp_autostartmeas::StartsByItself;
use crate::telegram::tsc_time_client::{
    TimeDelay, TimeInterface, TimeOffset, TimeRole, TimeServer, TimeUpdate, TimeZone,
};

/// Each variable with its one value.
macro_rules! fixed {
    ($($(#[doc = $why:literal])? $variable:ident { $field:ident: $value:expr })*) => {$(
        impl Readable for $variable {
            $(#[doc = $why])?
            fn get(_: &Context<'_>) -> Self {
                Self { $field: $value }
            }
        }
    )*};
}

fixed! {
    /// As delivered.
    IpAddress { address: [192, 168, 0, 1] }
    NetworkMask { mask: [255, 255, 255, 0] }
    Gateway { address: [0, 0, 0, 0] }
    /// No time server.
    TimeRole { code: 0 }
    TimeInterface { code: 0 }
    TimeServer { address: [0, 0, 0, 0] }
    /// Not verified.
    TimeUpdate { seconds: 10 }
    /// Universal time.
    TimeZone { hours_plus_12: 12 }
    /// No server was ever asked.
    TimeOffset { seconds: 0.0 }
    TimeDelay { seconds: 0.0 }
    StartsByItself { on: true }
}
