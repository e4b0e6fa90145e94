//! `DeviceIdent` (also `sRI 0`): what the scanner is.

use super::Variable;
use super::wire::{FlexString, fields};

fields! {
    /// Type and version, as clients show and check them.
    pub struct DeviceIdent {
        /// Type, for example `LMS111`.
        pub name: FlexString,
        /// Firmware version, for example `V1.80`.
        pub version: FlexString,
    }
}

impl Variable for DeviceIdent {
    const NAME: &'static str = "DeviceIdent";
}

/// The index `sRI` reads DeviceIdent by; stands where the name does.
pub const INDEX: &str = "0";
