//! `SerialNumber`.

use super::Variable;
use super::wire::{FlexString, fields};

fields! {
    /// Serial number, in decimal.
    pub struct SerialNumber {
        /// The digits.
        pub text: FlexString,
    }
}

impl Variable for SerialNumber {
    const NAME: &'static str = "SerialNumber";
}
