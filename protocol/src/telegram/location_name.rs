//! `LocationName`: the name an owner gave the scanner.

use super::Variable;
use super::wire::{FlexString, fields};

fields! {
    /// Name of the scanner; `not defined` out of the box.
    pub struct LocationName {
        /// The text.
        pub text: FlexString,
    }
}

impl Variable for LocationName {
    const NAME: &'static str = "LocationName";
}
