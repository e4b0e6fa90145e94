//! `LIDinputstate`: digital inputs.

use super::Variable;
use super::lmd_scandata::DateTime;
use super::wire::fields;

fields! {
    /// State of the digital inputs.
    pub struct InputState {
        /// Telegram version.
        pub version: u16,
        /// µs since power-up.
        pub time_us: u32 ["µs"],
        /// Each input: 0 off, 1 on, 2 unused.
        pub inputs: [u8; 4],
        /// Date and time.
        pub date_time: Option<DateTime>,
    }
}

impl Variable for InputState {
    const NAME: &'static str = "LIDinputstate";
}
