//! `SCdevicestate`: may a client expect scans?

use super::Variable;
use super::wire::fields;

fields! {
    /// Device state.
    pub struct DeviceState {
        /// [`BUSY`], [`READY`], [`ERROR`] or [`STANDBY`].
        pub state: u8,
    }
}

impl Variable for DeviceState {
    const NAME: &'static str = "SCdevicestate";
}

/// Busy, or somebody is logged in.
pub const BUSY: u8 = 0;
/// Ready.
pub const READY: u8 = 1;
/// Error.
pub const ERROR: u8 = 2;
/// Standby (not verified on a device).
pub const STANDBY: u8 = 3;
