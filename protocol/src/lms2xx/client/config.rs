//! How a device is to be set up.

use core::time::Duration;

use crate::lms2xx::values::{MeasuringMode, Unit};
use crate::lms2xx::{Rate, Variant};

/// How a device is to be set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lms2xxConfig {
    /// The rate to stream at; the one it is found at where the device cannot, or the line does not carry it.
    pub rate: Rate,
    /// The rate the device answered at last, tried first.
    pub known: Option<Rate>,
    /// Angle and resolution; as the device has it where absent.
    pub variant: Option<Variant>,
    /// Unit of the values.
    pub unit: Unit,
    /// What their bits mean.
    pub measuring_mode: MeasuringMode,
    /// Have the device count mirror turns beside the values, so that lost telegrams show.
    pub real_time_index: bool,
    /// Ask for remission beside the ranges: `F5` (`C4` from an S14), twice as long on the line. It sets the measuring mode for that.
    pub remission: bool,
    /// How long a reply may take, beside its transmission and that of what is on the line before it.
    pub reply_timeout: Duration,
    /// The same for a write of the configuration block: the device's EEPROM is slow.
    pub save_timeout: Duration,
    /// How long the device takes to change its rate.
    pub settle: Duration,
}

impl Default for Lms2xxConfig {
    fn default() -> Self {
        Self {
            rate: Rate::R38400,
            known: None,
            variant: None,
            unit: Unit::Mm,
            measuring_mode: MeasuringMode::RANGE_32_M,
            real_time_index: true,
            remission: false,
            reply_timeout: Duration::from_millis(300),
            save_timeout: Duration::from_secs(15),
            settle: Duration::from_millis(300),
        }
    }
}
