//! The block of 34 bytes (32 in old firmware) that `74` reads and `77` writes: what the device keeps in its EEPROM.
//!
//! Source: telegram listing 8007954, table 7-122. A host takes the length from the frame and writes back what it has read.

use super::values::{MeasuringMode, Unit};
use super::words::word;

/// Bytes of the longest block.
pub const LENGTH: usize = 34;
/// Bytes of the block of firmware before V2.10 and X1.10.
pub const OLD_LENGTH: usize = 32;

/// High byte of B: peak threshold and black extension, or sensitivity.
const SENSITIVITY: usize = 3;
const AVAILABILITY: usize = 4;
const MEASURING_MODE: usize = 5;
const UNIT: usize = 6;
const TEMPORARY_FIELD: usize = 7;
const SUBTRACTIVE: usize = 8;
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
const SINGLE_VALUES: usize = 29;
/// Low byte of A4: scans with dazzle until the outputs switch.
const DAZZLE: usize = 32;

/// Evaluations until a field counts.
const MOST_EVALUATIONS: u8 = 125;
/// Of the restart mode: the mode itself. The bits above are flags.
const RESTART_MODE: u8 = 0x1F;
/// Slave, restart at once: the last one listed.
const LAST_RESTART_MODE: u8 = 6;

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

    /// True if every field is within the range that the listing gives for it (T6-9, T7-122).
    pub fn is_listed(&self) -> bool {
        let [sensitivity, temporary, subtractive, single_values] =
            [SENSITIVITY, TEMPORARY_FIELD, SUBTRACTIVE, SINGLE_VALUES].map(|at| self.block[at]);
        let dazzle = word([self.block[DAZZLE], self.block[DAZZLE + 1]]);
        self.unit().is_some()
            && self.measuring_mode().is_known()
            && sensitivity <= 3
            && temporary <= 2
            && subtractive <= 1
            && (1..=MOST_EVALUATIONS).contains(&self.evaluations())
            && self.restart() & RESTART_MODE <= LAST_RESTART_MODE
            && single_values <= 1
            // The short block has no such field.
            && (self.length < LENGTH || (1..=255).contains(&dazzle))
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

    /// Whether single values are faded out below a threshold.
    pub fn fades_out_single_values(&self) -> bool {
        self.block[SINGLE_VALUES] != 0
    }

    /// The largest object that fields do not see, centimetres.
    pub fn blanking_cm(&self) -> u16 {
        word([self.block[0], self.block[1]])
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Offset in the block, values at the ends of its listed range, values beyond.
    const RANGES: &[(usize, &[u8], &[u8])] = &[
        (SENSITIVITY, &[0, 3], &[4, 255]),
        (MEASURING_MODE, &[0, 0x3F], &[0x10, 0x3D]),
        (UNIT, &[0, 1], &[2, 255]),
        (TEMPORARY_FIELD, &[0, 2], &[3, 255]),
        (SUBTRACTIVE, &[0, 1], &[2, 255]),
        (EVALUATIONS, &[1, 125], &[0, 126, 255]),
        (RESTART, &[0, 6, 0x26, 0x46, 0x86, 0xE6], &[7, 0x1F, 0xFF]),
        (SINGLE_VALUES, &[0, 1], &[2, 255]),
        (DAZZLE, &[1, 255], &[0]),
        (DAZZLE + 1, &[0], &[1, 255]),
    ];

    #[test]
    fn what_is_listed_is_known_from_what_is_not() {
        let block = Configuration::new(MeasuringMode::default(), Unit::Mm);
        for (at, listed, beyond) in RANGES {
            for (values, expected) in [(listed, true), (beyond, false)] {
                for value in values.iter() {
                    let mut written = block.block;
                    written[*at] = *value;
                    assert_eq!(block.overwritten(&written).is_listed(), expected, "{at}: {value}");
                }
            }
        }
    }

    #[test]
    fn the_blocks_out_of_the_box_are_listed() {
        for unit in [Unit::Cm, Unit::Mm] {
            assert!(Configuration::new(MeasuringMode::default(), unit).is_listed());
            assert!(Configuration::old(MeasuringMode::default(), unit).is_listed());
        }
    }
}
