//! `STlms`: status with temperature, clock and lamps. The binary layout follows from the field types; it was not seen on the wire.

use super::Variable;
use super::wire::{FlexString, fields};

fields! {
    /// Status.
    pub struct Status {
        /// One of the states below, 7 = measuring.
        pub state: u16,
        /// Temperature range, 0 = within.
        pub temperature: u8,
        /// Time of day, `hh:mm:ss`.
        pub time: FlexString,
        /// Date, `dd.mm.yy`.
        pub date: FlexString,
        /// Lamps.
        pub lamps: [u32; 3],
    }
}

impl Variable for Status {
    const NAME: &'static str = "STlms";
}

/// Undefined; what a device out of order reports (not verified).
pub const UNDEFINED: u16 = 0;
/// Initialisation.
pub const INITIALISATION: u16 = 1;
/// Configuration.
pub const CONFIGURATION: u16 = 2;
/// Idle: laser and motor off.
pub const IDLE: u16 = 3;
/// The mirror turns, the laser is off.
pub const ROTATING: u16 = 4;
/// In preparation.
pub const PREPARING: u16 = 5;
/// Ready.
pub const READY: u16 = 6;
/// Measuring.
pub const MEASURING: u16 = 7;
