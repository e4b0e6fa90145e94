//! `OrdNum`, `DItype`: order number and type code, as the label on the device has them.

use super::Variable;
use super::wire::{FlexString, fields};

fields! {
    /// Order number.
    pub struct OrderNumber {
        /// Digits.
        pub text: FlexString,
    }

    /// Type code, for example `LMS111-10100`.
    pub struct TypeCode {
        /// The code.
        pub text: FlexString,
    }
}

impl Variable for OrderNumber {
    const NAME: &'static str = "OrdNum";
}

impl Variable for TypeCode {
    const NAME: &'static str = "DItype";
}
