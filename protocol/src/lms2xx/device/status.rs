//! The status telegram `B1`: some 150 bytes at fixed places.

use alloc::vec::Vec;

use super::Device;
use crate::lms2xx::Rate;

/// Bytes of the telegram without its status byte, the command included.
const LENGTH: usize = 153;

/// Places of what clients read, the command being place 0.
pub(crate) mod place {
    pub(crate) const SOFTWARE: usize = 1;
    pub(crate) const MODE: usize = 8;
    pub(crate) const VARIANT: usize = 18;
    pub(crate) const POLLUTION: usize = 19;
    pub(crate) const REFERENCE_POLLUTION: usize = 35;
    pub(crate) const CALIBRATION: usize = 43;
    pub(crate) const REFERENCE_CALIBRATION: usize = 59;
    pub(crate) const MOTOR: usize = 67;
    pub(crate) const MEASURING_MODE: usize = 102;
    pub(crate) const ANGLE: usize = 107;
    pub(crate) const STEP: usize = 109;
    pub(crate) const RESTART: usize = 111;
    pub(crate) const RESTART_TIME: usize = 112;
    pub(crate) const OFFSET: usize = 114;
    pub(crate) const RATE: usize = 116;
    pub(crate) const EVALUATIONS: usize = 118;
    pub(crate) const PERMANENT: usize = 119;
    pub(crate) const FIELD_SET: usize = 121;
    pub(crate) const UNIT: usize = 122;
    pub(crate) const LASER: usize = 123;
    pub(crate) const BOOT_PROM: usize = 124;
}

/// What 1/90 turn of the mirror takes, µs.
const MOTOR: u16 = 148;
const LASER_ON: u8 = 1;
/// A clean window, in the device's own digits.
const CLEAN: u16 = 1000;

impl Device {
    /// Appends what follows the command.
    pub(super) fn status(&self, body: &mut Vec<u8>) {
        let mut bytes = [0; LENGTH];
        let mut put = |at: usize, field: &[u8]| {
            bytes.iter_mut().skip(at).zip(field).for_each(|(to, from)| *to = *from);
        };
        put(place::SOFTWARE, self.firmware.text().as_bytes());
        put(place::MODE, &[self.mode_number()]);
        // Of the special devices S19 and S20 only it would be 1.
        put(place::VARIANT, &[0]);
        for (at, words) in [
            (place::POLLUTION, 8),
            (place::REFERENCE_POLLUTION, 4),
            (place::CALIBRATION, 8),
            (place::REFERENCE_CALIBRATION, 4),
        ] {
            (0..words).for_each(|word| put(at + 2 * word, &CLEAN.to_le_bytes()));
        }
        put(place::MOTOR, &MOTOR.to_le_bytes());
        put(place::MEASURING_MODE, &[self.configuration.measuring_mode().0]);
        put(place::ANGLE, &self.variant.angle_deg.to_le_bytes());
        put(place::STEP, &self.variant.step_centideg.to_le_bytes());
        put(place::RESTART, &[self.configuration.restart()]);
        put(place::RESTART_TIME, &[self.configuration.restart_time()]);
        put(place::OFFSET, self.part_2.get(4..5).unwrap_or_default());
        put(place::RATE, &rate_code(self.rate).to_le_bytes());
        put(place::EVALUATIONS, &[self.configuration.evaluations()]);
        put(place::PERMANENT, &[u8::from(self.kept_rate != Rate::R9600)]);
        put(place::FIELD_SET, &[self.field_set]);
        put(place::UNIT, &[self.configuration.unit().unwrap_or_default() as u8]);
        put(place::LASER, &[LASER_ON]);
        put(place::BOOT_PROM, self.firmware.text().as_bytes());
        body.extend_from_slice(bytes.get(1..).unwrap_or_default());
    }
}

/// The divisor of a 1 MHz clock, less one, with the top bit set (telegram listing, table 7-34).
fn rate_code(rate: Rate) -> u16 {
    0x8000 | (1_000_000 / rate.bits_per_second() - 1) as u16
}

/// The rate of a [`rate_code`].
pub(crate) fn rate_of(code: u16) -> Option<Rate> {
    Rate::ALL.into_iter().find(|rate| rate_code(*rate) == code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_codes_are_the_listings() {
        let codes = [Rate::R500000, Rate::R38400, Rate::R19200, Rate::R9600].map(rate_code);
        assert_eq!(codes, [0x8001, 0x8019, 0x8033, 0x8067]);
    }
}
