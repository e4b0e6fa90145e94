//! `LSPdatetime` and `LSPsetdatetime`: the device's calendar. Layout not verified on the wire.

use super::lmd_scandata::DateTime;
use super::wire::fields;
use super::{Method, Variable};

fields! {
    /// Date and time now.
    pub struct CurrentDateTime {
        /// The calendar.
        pub now: DateTime,
    }

    /// Sets the calendar.
    pub struct SetDateTime {
        /// The calendar.
        pub now: DateTime,
    }
}

impl Variable for CurrentDateTime {
    const NAME: &'static str = "LSPdatetime";
}

impl Method for SetDateTime {
    const NAME: &'static str = "LSPsetdatetime";
    type Reply = bool;
}
