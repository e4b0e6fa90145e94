//! `PerformanceProfileNumber`: the scan mode of a picoScan, by its number.

use super::Variable;
use super::wire::fields;

fields! {
    /// A scan mode's number, from 1 on.
    pub struct PerformanceProfileNumber {
        /// The number.
        pub number: u8,
    }
}

impl Variable for PerformanceProfileNumber {
    const NAME: &'static str = "PerformanceProfileNumber";
}
