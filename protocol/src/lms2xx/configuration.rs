//! The block of 34 bytes that `74` reads and `77` writes: what the device keeps in its EEPROM.

use super::values::{MeasuringMode, Unit};

/// Bytes of the block.
pub const LENGTH: usize = 34;

const AVAILABILITY: usize = 4;
const MEASURING_MODE: usize = 5;
const UNIT: usize = 6;
const RESTART: usize = 9;

/// Availability: a byte that counts scans comes with the values.
const REAL_TIME_INDEX: u8 = 0x02;

/// The configuration block, as it is sent. Named are the fields that change what this device or this host does; the others are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Configuration(pub [u8; LENGTH]);

impl Configuration {
    /// A block with nothing set but these.
    pub const fn new(mode: MeasuringMode, unit: Unit) -> Self {
        let mut block = [0; LENGTH];
        block[MEASURING_MODE] = mode.0;
        block[UNIT] = unit as u8;
        Self(block)
    }

    /// What `77` makes of it: a short write leaves the rest unchanged, as a public client relies on. `None` if there are more bytes than
    /// the block has.
    pub fn overwritten(mut self, bytes: &[u8]) -> Option<Self> {
        self.0.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(self)
    }

    /// What the bits of a value mean.
    pub fn measuring_mode(&self) -> MeasuringMode {
        MeasuringMode(self.0[MEASURING_MODE])
    }

    /// Sets it.
    pub fn set_measuring_mode(&mut self, mode: MeasuringMode) {
        self.0[MEASURING_MODE] = mode.0;
    }

    /// Unit of the values.
    pub fn unit(&self) -> Option<Unit> {
        Unit::of(self.0[UNIT])
    }

    /// Sets it.
    pub fn set_unit(&mut self, unit: Unit) {
        self.0[UNIT] = unit as u8;
    }

    /// Whether a byte that counts scans comes with the values.
    pub fn real_time_index(&self) -> bool {
        self.0[AVAILABILITY] & REAL_TIME_INDEX != 0
    }

    /// Sets it; the other availability bits stay.
    pub fn set_real_time_index(&mut self, on: bool) {
        self.0[AVAILABILITY] = self.0[AVAILABILITY] & !REAL_TIME_INDEX | if on { REAL_TIME_INDEX } else { 0 };
    }

    /// Restart mode.
    pub fn restart(&self) -> u8 {
        self.0[RESTART]
    }
}
