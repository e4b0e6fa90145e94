//! `FREchoFilter`: which echoes are delivered.

use super::Variable;
use super::wire::fields;

fields! {
    /// Echo filter: 0 first echo, 1 all, 2 last.
    pub struct EchoFilter {
        /// The code.
        pub code: u8,
    }
}

impl Variable for EchoFilter {
    const NAME: &'static str = "FREchoFilter";
}

/// First echo only.
pub const FIRST: u8 = 0;
/// All echoes, each in its channel.
pub const ALL: u8 = 1;
/// Last echo only.
pub const LAST: u8 = 2;
