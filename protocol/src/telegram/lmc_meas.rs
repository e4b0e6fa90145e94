//! `LMCstartmeas`, `LMCstopmeas`, `LMCstandby`: laser and mirror on and off.

use super::Method;
use super::wire::fields;

fields! {
    /// Start measuring. The reply is [`ACCEPTED`] or another code.
    pub struct StartMeasurement {
    }

    /// Stop measuring: laser and motor off.
    pub struct StopMeasurement {
    }

    /// Laser off, the mirror keeps turning.
    pub struct Standby {
    }
}

impl Method for StartMeasurement {
    const NAME: &'static str = "LMCstartmeas";
    type Reply = u8;
}

impl Method for StopMeasurement {
    const NAME: &'static str = "LMCstopmeas";
    type Reply = u8;
}

impl Method for Standby {
    const NAME: &'static str = "LMCstandby";
    type Reply = u8;
}

/// What the three answer when they succeed.
pub const ACCEPTED: u8 = 0;
