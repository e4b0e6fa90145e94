//! `ODpwrc`: power-on count.

use super::Variable;
use super::wire::fields;

fields! {
    /// How often the scanner was switched on.
    pub struct PowerOnCount {
        /// Times.
        pub count: u32,
    }
}

impl Variable for PowerOnCount {
    const NAME: &'static str = "ODpwrc";
}
