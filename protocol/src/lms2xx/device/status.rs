//! The status telegram `B1`: some 150 bytes at fixed places.

use alloc::vec::Vec;

use super::Device;
use crate::device::Profile;
use crate::lms2xx::Rate;
use crate::lms2xx::telegram::STATUS_OK;
use crate::random::Stream;
use crate::time::SimTime;

use super::sweep::Sweep;

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
    pub(crate) const LASER_POWER: usize = 83;
    pub(crate) const CALIBRATED_POWER: usize = 91;
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
/// What the window's channels read when they were calibrated, in the device's own digits.
const CALIBRATED: u16 = 1000;
/// Laser power, percent of the calibration.
const FULL_POWER: u16 = 100;
/// How far one reading differs from the next with `Profile::Field`: digits of a channel, µs of the motor. Assumed.
const CHANNEL_SPREAD: u16 = 8;
const MOTOR_SPREAD: u16 = 1;
/// Error numbers of dirt on the two channels (table 10-18).
const DIRT: [u8; 2] = [18, 19];
const WARNING: u8 = 2;
const ERROR: u8 = 3;
/// In the status byte of every reply.
const POLLUTED: u8 = 0x80;

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
        let mut readings = self.readings();
        for word in 0..8 {
            let now = readings.about(CALIBRATED / 100 * self.clear_percent(word), CHANNEL_SPREAD);
            put(place::POLLUTION + 2 * word, &now.to_le_bytes());
            put(place::CALIBRATION + 2 * word, &CALIBRATED.to_le_bytes());
        }
        for word in 0..4 {
            let now = readings.about(CALIBRATED, CHANNEL_SPREAD);
            put(place::REFERENCE_POLLUTION + 2 * word, &now.to_le_bytes());
            put(place::REFERENCE_CALIBRATION + 2 * word, &CALIBRATED.to_le_bytes());
        }
        put(place::MOTOR, &readings.about(MOTOR, MOTOR_SPREAD).to_le_bytes());
        put(place::LASER_POWER, &FULL_POWER.to_le_bytes());
        put(place::CALIBRATED_POWER, &FULL_POWER.to_le_bytes());
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

    /// The status byte: an LMS, and how it is.
    pub(super) fn status_byte(&self) -> u8 {
        STATUS_OK
            | match self.contamination() {
                0 => 0,
                1 => POLLUTED | WARNING,
                _ => POLLUTED | ERROR,
            }
    }

    /// Appends the errors: pairs of weight and number.
    pub(super) fn errors(&self, body: &mut Vec<u8>) {
        let [first, second] = DIRT;
        let found = [(WARNING, first), (ERROR, first), (ERROR, second)];
        let found = match self.contamination() {
            0 => &[],
            1 => &found[..1],
            2 => &found[1..2],
            _ => &found[1..],
        };
        found.iter().for_each(|(weight, number)| body.extend_from_slice(&[*weight, *number]));
    }

    /// How much light one of the eight channels of the window lets through: below 75 % is a warning, below 30 % an error. Which of them
    /// is which is not stated: the first half is channel 1.
    fn clear_percent(&self, word: usize) -> u16 {
        match (self.contamination(), word) {
            (1, 0..=3) => 65,
            (2, 0..=3) | (3.., _) => 25,
            _ => 100,
        }
    }

    /// Readings of the mirror turn that the last byte came in; exact on the bench.
    fn readings(&self) -> Readings {
        let turn = Sweep::turn_of(self.last_byte.unwrap_or(SimTime::ZERO));
        let noisy = self.options.profile == Profile::Field;
        Readings(noisy.then(|| Stream::keyed(0, &[READINGS, turn])))
    }
}

/// What the readings' random stream is for.
const READINGS: u64 = 0x7265_6164;

/// Readings of analogue values: exact, or with a spread.
struct Readings(Option<Stream>);

impl Readings {
    fn about(&mut self, value: u16, spread: u16) -> u16 {
        let Some(stream) = &mut self.0 else { return value };
        let steps = f64::from(2 * spread + 1);
        (value + (stream.unit() * steps) as u16).saturating_sub(spread)
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
