//! `FirmwareVersion`.

use super::Variable;
use super::wire::{FlexString, fields};

fields! {
    /// Firmware version. Devices pad it with blanks: `V1.80.2  `.
    pub struct FirmwareVersion {
        /// The text.
        pub text: FlexString,
    }
}

impl Variable for FirmwareVersion {
    const NAME: &'static str = "FirmwareVersion";
}
