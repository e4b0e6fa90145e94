//! `LMPoutputRange`: the part of the turn that is sent.

use alloc::vec::Vec;

use super::Variable;
use super::wire::fields;

fields! {
    /// Angular range of the scan telegrams. It cuts beams away; it never moves one.
    pub struct OutputRange {
        /// One sector on the scanners known here.
        pub sectors: Vec<Sector>,
    }

    /// A sector of the turn.
    pub struct Sector {
        /// Angle between beams, 1/10000°.
        pub step: u32 ["1/10000°"],
        /// First device angle, 1/10000°.
        pub start: i32 ["1/10000°"],
        /// Last device angle, 1/10000°.
        pub stop: i32 ["1/10000°"],
    }
}

impl Variable for OutputRange {
    const NAME: &'static str = "LMPoutputRange";
}
