//! A digital line of a scanner that is switched at a given instant.

use rowscan_protocol::device::{Device, DigitalLineError};
use rowscan_protocol::time::SimTime;

/// A digital line that is switched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineChange {
    /// When.
    pub at: SimTime,
    /// An output; else an input.
    pub output: bool,
    /// Which, from 1.
    pub number: u8,
    /// On; else off.
    pub on: bool,
}

impl LineChange {
    /// Switches it on `device`.
    pub fn apply(&self, device: &mut Device) -> Result<(), DigitalLineError> {
        match self.output {
            true => device.set_output(self.at, self.number, self.on),
            false => device.set_input(self.at, self.number, self.on),
        }
    }
}
