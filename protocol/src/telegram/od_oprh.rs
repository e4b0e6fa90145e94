//! `ODoprh`: operating hours.

use super::Variable;
use super::wire::fields;

fields! {
    /// Time the scanner has been on.
    pub struct OperatingHours {
        /// Tenths of an hour.
        pub tenths: u32 ["1/10 h"],
    }
}

impl Variable for OperatingHours {
    const NAME: &'static str = "ODoprh";
}
