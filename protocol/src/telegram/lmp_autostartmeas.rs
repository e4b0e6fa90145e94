//! `LMPautostartmeas`: whether the scanner measures from power-up on.

use super::Variable;
use super::wire::fields;

fields! {
    /// The switch.
    #[derive(Copy)]
    pub struct StartsByItself {
        /// It measures without being told.
        pub on: bool,
    }
}

impl Variable for StartsByItself {
    const NAME: &'static str = "LMPautostartmeas";
}
