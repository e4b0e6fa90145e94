//! The block of 34 bytes (32 in old firmware) that `74` reads and `77` writes: what the device keeps in its EEPROM.
//!
//! Source: telegram listing 8007954, table 7-122. A host takes the length from the frame and writes back what it has read.

use super::values::{MeasuringMode, Unit};

/// Bytes of the longest block.
pub const LENGTH: usize = 34;
/// Bytes of the block of firmware before V2.10 and X1.10.
pub const OLD_LENGTH: usize = 32;

const AVAILABILITY: usize = 4;
const MEASURING_MODE: usize = 5;
const UNIT: usize = 6;
const EVALUATIONS: usize = 9;
const RESTART: usize = 10;
const RESTART_TIME: usize = 11;

/// Availability: scan index and telegram index come with the values.
const INDICES: u8 = 0x02;

/// Stop threshold, millivolts.
const STOP_THRESHOLD: u8 = 0x46;
/// A contour out of the box: off, 10 cm to either side, 80° to 100°.
const CONTOUR: [u8; 5] = [0x00, 0x0A, 0x0A, 0x50, 0x64];
const CONTOURS: [usize; 3] = [13, 18, 23];
/// Low byte of A4: scans with dazzle until the outputs switch.
const DAZZLE: usize = 32;

/// The configuration block, as it is sent. Named are the fields that change what this device or this host does; the others are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Configuration {
    block: [u8; LENGTH],
    length: usize,
}

impl Configuration {
    /// The block out of the box (table 7-122), in this unit: two evaluations, no restart interlock, contours off.
    pub const fn new(mode: MeasuringMode, unit: Unit) -> Self {
        let mut block = [0; LENGTH];
        block[2] = STOP_THRESHOLD;
        block[MEASURING_MODE] = mode.0;
        block[UNIT] = unit as u8;
        block[EVALUATIONS] = 2;
        block[RESTART] = 2;
        block[RESTART_TIME] = 2;
        let mut contour = 0;
        while contour < CONTOURS.len() {
            let mut byte = 0;
            while byte < CONTOUR.len() {
                block[CONTOURS[contour] + byte] = CONTOUR[byte];
                byte += 1;
            }
            contour += 1;
        }
        block[DAZZLE] = 2;
        Self { block, length: LENGTH }
    }

    /// The block of 32 bytes out of the box, as the Quick Manual's frames have it: no contours, no restart time.
    pub fn old(mode: MeasuringMode, unit: Unit) -> Self {
        let mut old = Self { length: OLD_LENGTH, ..Self::new(mode, unit) };
        old.block.iter_mut().skip(RESTART_TIME).for_each(|byte| *byte = 0);
        old
    }

    /// The block in these bytes; `None` if no device has one of that length.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let length = [LENGTH, OLD_LENGTH].into_iter().find(|length| *length == bytes.len())?;
        let mut block = [0; LENGTH];
        block.get_mut(..length)?.copy_from_slice(bytes);
        Some(Self { block, length })
    }

    /// As it is sent.
    pub fn bytes(&self) -> &[u8] {
        self.block.get(..self.length).unwrap_or(&self.block)
    }

    /// What `77` makes of it: a short write leaves the rest unchanged, and bytes beyond the block's end are ignored, as between hosts and
    /// devices of different age.
    pub fn overwritten(mut self, bytes: &[u8]) -> Self {
        self.block.iter_mut().take(self.length).zip(bytes).for_each(|(to, from)| *to = *from);
        self
    }

    /// What the bits of a value mean.
    pub fn measuring_mode(&self) -> MeasuringMode {
        MeasuringMode(self.block[MEASURING_MODE])
    }

    /// Sets it.
    pub fn set_measuring_mode(&mut self, mode: MeasuringMode) {
        self.block[MEASURING_MODE] = mode.0;
    }

    /// Unit of the values.
    pub fn unit(&self) -> Option<Unit> {
        Unit::of(self.block[UNIT])
    }

    /// Sets it.
    pub fn set_unit(&mut self, unit: Unit) {
        self.block[UNIT] = unit as u8;
    }

    /// Whether scan index and telegram index come with the values.
    pub fn real_time_index(&self) -> bool {
        self.block[AVAILABILITY] & INDICES != 0
    }

    /// Whether the device can send them: those with the short block cannot.
    pub fn has_indices(&self) -> bool {
        self.length == LENGTH
    }

    /// Sets it; the other availability bits stay.
    pub fn set_real_time_index(&mut self, on: bool) {
        self.block[AVAILABILITY] = self.block[AVAILABILITY] & !INDICES | if on { INDICES } else { 0 };
    }

    /// The largest object that fields do not see, centimetres.
    pub fn blanking_cm(&self) -> u16 {
        u16::from_le_bytes([self.block[0], self.block[1]])
    }

    /// Evaluations until an infringed field counts.
    pub fn evaluations(&self) -> u8 {
        self.block[EVALUATIONS]
    }

    /// Restart mode.
    pub fn restart(&self) -> u8 {
        self.block[RESTART]
    }

    /// Restart time of field A, in the unit that the restart mode names.
    pub fn restart_time(&self) -> u8 {
        self.block[RESTART_TIME]
    }
}
