//! `ODoprh`, `ODopdaily`: operating hours.

use super::Variable;
use super::wire::fields;

fields! {
    /// Time the scanner has been on.
    pub struct OperatingHours {
        /// Tenths of an hour.
        pub tenths: u32 ["1/10 h"],
    }

    /// Time since it was switched on. Not recorded: the form of its neighbour.
    pub struct HoursSincePowerUp {
        /// Tenths of an hour.
        pub tenths: u32 ["1/10 h"],
    }
}

impl Variable for HoursSincePowerUp {
    const NAME: &'static str = "ODopdaily";
}

impl Variable for OperatingHours {
    const NAME: &'static str = "ODoprh";
}
