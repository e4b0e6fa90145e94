//! `LCMstate`: contamination of the front screen.

use super::Variable;
use super::wire::fields;

fields! {
    /// Contamination: 0 clean, 1 warning, 2 error, 3 serious error.
    pub struct Contamination {
        /// The level.
        pub level: u8,
    }
}

impl Variable for Contamination {
    const NAME: &'static str = "LCMstate";
}
